# SPDX-License-Identifier: MIT
"""The withheld answers of a check, as `answers.json` has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import msgspec

from ehsid.harness.base.encoding import from_json

Kind = Literal["one", "two", "none", "params", "open"]


@dataclass(frozen=True)
class Answer:
    """The withheld truth of a case.

    Attributes
    ----------
    kind
        "one" or "two" effects of the catalogue, "none", "params" (wrong values only), or "open"
        (an effect outside of the catalogue).
    grade, plant, sensors, excitation
        as the generator names them; excitation of the fitted and of the held-out record.
    effects
        sizes by effect and parameter, SI.
    subsystem
        subsystems of the effects.
    true
        true values of the rig by full name, SI.
    largest_command
        largest command in each of the two records, as a share of rated command.
    families
        kinds of physics, measurement and excitation of a wide case by trait, to group results.
    """

    kind: Kind
    grade: str
    plant: str
    sensors: str
    excitation: tuple[str, ...]
    effects: Mapping[str, Mapping[str, float]]
    subsystem: tuple[str, ...]
    true: Mapping[str, float] = field(default_factory=dict)
    largest_command: tuple[float, ...] = ()
    families: Mapping[str, str] = field(default_factory=dict)


def read_answers(path: Path) -> dict[str, Answer]:
    """Reads the answers, by name of the case.

    Raises
    ------
    ValueError
        there is no such file, or it is not one of a check.
    """
    where = str(path)
    answers = {}
    try:
        raw = from_json(path.read_bytes(), dict[str, msgspec.Raw])
        for name in sorted(raw):
            where = f"{path}: case {name}"
            answers[name] = from_json(raw[name], Answer)
    except FileNotFoundError:
        raise ValueError(f"{path}: there is no such file; a check writes it") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{where}: not an answer of a check: {error}; restore the file") from None
    return answers
