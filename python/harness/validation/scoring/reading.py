# SPDX-License-Identifier: MIT
"""Finished cases as they lie in the folder of a check: what is true, and what was said."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from ehsid.harness.gap.diagnosis_file import (
    DiagnosisFile,
    HowFar,
    Value,
    known,
    read_diagnosis_file,
)
from ehsid.harness.gap.schema import Estimate

T = TypeVar("T")
FAILED = "failed"  # in place of a verdict, where the diagnosis raised an error
GRADES = ("plain", "hard", "confusable")
SENSORS = ("pressures", "position only")


@dataclass(frozen=True)
class Answer:
    """What was withheld.

    Attributes
    ----------
    kind
        "one" or "two" effects of the catalogue, "none", "params", or "open": one that it has not.
    grade, plant, sensors, excitation
        as the generator names them; excitation of the records to fit and to judge by.
    effects
        sizes by effect and parameter, SI.
    subsystems
        of the effects.
    true
        values of the rig by full name.
    largest_command
        share of rated, in any of the records.
    """

    kind: str
    grade: str
    plant: str
    sensors: str
    excitation: tuple[str, ...]
    effects: Mapping[str, Mapping[str, float]]
    subsystems: tuple[str, ...]
    true: Mapping[str, float] = field(default_factory=dict)
    largest_command: float = math.nan

    @property
    def measured(self) -> str:
        """One of `SENSORS`."""
        return SENSORS[0] if "pressure" in self.sensors else SENSORS[1]


@dataclass(frozen=True)
class Named:
    """An effect of `which.effects`; sizes by parameter."""

    id: str
    probability: float
    sizes: Mapping[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True)
class Tried:
    """A set of `which.candidates`; costs in nats, None where the file does not have them."""

    effects: tuple[str, ...]
    score: float
    fitted_cost: float | None = None
    held_out_cost: float | None = None
    free: int | None = None


@dataclass(frozen=True)
class Said:
    """What scoring reads of a diagnosis file.

    Attributes
    ----------
    verdict
        of the six, or `FAILED`.
    named, sets, tried, cannot_judge
        `which`.
    subsystem
        shares of `where`.
    residuals
        of the equations: subsystem, and residual over its noise.
    calibration
        found values by full name.
    gap
        of the calibrated rig over the middle of its noise floor; None where it is not known.
    of_explainable, from_nominal
        shrinkage on held-out data.
    seconds
        it took.
    settings
        of the diagnosis.
    """

    verdict: str
    named: tuple[Named, ...] = ()
    sets: tuple[tuple[str, ...], ...] = ()
    tried: tuple[Tried, ...] = ()
    cannot_judge: frozenset[str] = frozenset()
    subsystem: Mapping[str, float] = field(default_factory=dict)
    residuals: tuple[tuple[str, float], ...] = ()
    calibration: Mapping[str, Estimate] = field(default_factory=dict)
    gap: float | None = None
    of_explainable: Estimate | None = None
    from_nominal: Estimate | None = None
    seconds: float = math.nan
    settings: Mapping[str, Any] = field(default_factory=dict)


def read_answers(path: Path) -> dict[str, Answer]:
    """Answers by name of the case.

    Raises
    ------
    ValueError
        no such file, or not one of a check.
    """
    plain = _read(path)
    return {name: _parsed(path, name, one, _answer) for name, one in sorted(plain.items())}


def read_said(folder: Path) -> Said | None:
    """The result of a case; None where it has not been diagnosed yet."""
    if (folder / "diagnosis.json").is_file():
        return _said(read_diagnosis_file(folder / "diagnosis.json"))
    return Said(FAILED) if (folder / "error.txt").is_file() else None


def _read(path: Path) -> dict[str, Any]:
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(f"{path}: there is no such file; a check writes it") from None
    except ValueError as error:
        raise ValueError(f"{path}: not JSON: {error}; restore it from the check") from None
    if not isinstance(plain, dict):
        raise ValueError(f"{path}: expected an object, found {type(plain).__name__}")
    return plain


def _parsed(path: Path, name: str, plain: Any, parse: Callable[[Any], T]) -> T:
    where = f"{path}{': ' if name else ''}{name}"
    try:
        return parse(plain)
    except KeyError as error:
        raise ValueError(f"{where}: the key {error} is missing") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{where}: not as the contract has it: {error}") from None


def _answer(plain: dict[str, Any]) -> Answer:
    return Answer(
        plain["kind"],
        plain["grade"],
        plain.get("plant", "ehs"),
        plain["sensors"],
        tuple(plain["excitation"]),
        {name: dict(sizes) for name, sizes in plain["effects"].items()},
        tuple(plain["subsystem"]),
        dict(plain.get("true", {})),
        max(plain.get("largest_command", [math.nan])),
    )


def _said(file: DiagnosisFile) -> Said:
    which, far = file.which, file.how_far
    return Said(
        verdict=file.verdict,
        named=tuple(
            Named(
                one.id,
                known(one.probability),
                {name: size.estimate() for name, size in one.parameters.items()},
            )
            for one in which.effects
        ),
        sets=tuple(tuple(one) for one in which.ambiguity_set),
        tried=tuple(
            Tried(
                tuple(one.effects), known(one.score), one.fitted_cost, one.held_out_cost, one.free
            )
            for one in which.candidates
        ),
        cannot_judge=frozenset(one.id for one in which.cannot_judge),
        subsystem=file.where.subsystem,
        residuals=tuple(
            (one.subsystem, known(one.residual.value) / one.noise)
            for one in file.where.equations
            if one.noise
        ),
        calibration={
            name: Value(one.found, one.ci90).estimate() for name, one in file.calibration.items()
        },
        gap=_gap(far),
        of_explainable=_interval(far.shrinkage_of_explainable),
        from_nominal=_interval(far.shrinkage_from_nominal),
        seconds=known(file.provenance.seconds),
        settings=file.provenance.settings,
    )


def _interval(value: Value) -> Estimate | None:
    found = value.estimate()
    return found if math.isfinite(found.value) else None


def _gap(far: HowFar) -> float | None:
    ends = [end for end in far.noise_floor if end]
    if far.calibrated is None or not ends:
        return None
    return far.calibrated * len(ends) / sum(ends)
