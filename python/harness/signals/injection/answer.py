# SPDX-License-Identifier: MIT
"""Description of the effects injected into a log, for comparison with a diagnosis of this log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import ehsid


@dataclass(frozen=True)
class Answer:
    """The answer to an injected record: what was injected, and what a diagnosis should find.

    Attributes
    ----------
    put_in
        ids of the injected effects with their sizes, SI, as the caller gave them.
    effects
        effects of the catalogue that a diagnosis should find in addition to those of the original
        log, with their sizes, SI.
    parameters
        full names of values of the rig, each with the factor by which the machine's value is now
        larger.
    outside
        ids that are not in the catalogue and do not appear as an effect of it.
    not_exact
        sentences that say where the record differs from what a machine with these effects would
        have logged; empty where the two agree to rounding.
    remarks
        further sentences about the injection.
    rig, plant
        name of the rig and its plant, for which the record was made.
    source, sha256
        file name of the original record and its digest; None for a record made in memory.
    command
        rated_v (None for a motor), largest_v_before, largest_v, share_beyond_rated: V, and a share
        of the samples.
    samples
        numbers of samples: source, dropped_at_start, dropped_at_end, written.
    """

    put_in: Mapping[str, Mapping[str, float]]
    effects: Mapping[str, Mapping[str, float]]
    parameters: Mapping[str, float]
    outside: tuple[str, ...]
    not_exact: tuple[str, ...]
    remarks: tuple[str, ...]
    rig: str
    plant: str
    source: str | None
    sha256: str | None
    command: Mapping[str, float | None]
    samples: Mapping[str, int]

    def plain(self) -> dict[str, Any]:
        """Returns the answer as plain data for a file."""
        plain = asdict(self)
        source = {"file": plain.pop("source"), "sha256": plain.pop("sha256")}
        return {
            "schema_version": 1,
            "ehsid_version": ehsid.__version__,
            "source": source,
            **plain,
        }


def file_of(source: Path | None) -> str | None:
    """File name without the folder, which is private to the user."""
    return None if source is None else source.name
