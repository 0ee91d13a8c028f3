# SPDX-License-Identifier: MIT
"""What was put into a log: to be kept apart from it, and compared with a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import ehsid


@dataclass(frozen=True)
class Answer:
    """The answer to an injected record.

    Attributes
    ----------
    put_in
        ids with sizes, SI, as asked.
    effects
        of the catalogue: what a diagnosis is to find beside what it finds in the untouched log.
    parameters
        values of the rig by full name, and the factor by which the machine's is now larger.
    outside
        ids that are not in the catalogue and show as no effect of it.
    not_exact
        where the record is not what a machine with these effects would have logged, one sentence
        each; empty where it is, to rounding.
    remarks
        what else is to be known.
    rig, plant
        for which it was made.
    source, sha256
        name of the untouched record's file and its digest; None for a record made in memory.
    command
        rated_v (None for a motor), largest_v_before, largest_v, share_beyond_rated.
    samples
        source, dropped_at_start, dropped_at_end, written.
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
        """As plain data for a file."""
        told = asdict(self)
        source = {"file": told.pop("source"), "sha256": told.pop("sha256")}
        return {
            "schema_version": 1,
            "ehsid_version": ehsid.__version__,
            "source": source,
            **told,
        }


def file_of(source: Path | None) -> str | None:
    """The name alone: where it lies is nobody's business."""
    return None if source is None else source.name
