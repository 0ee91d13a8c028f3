# SPDX-License-Identifier: MIT
"""Reads the cases in the folder of a check: the truth, and what the diagnosis said."""

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
    subsystems
        subsystems of the effects.
    true
        true values of the rig by full name, SI.
    largest_command
        largest command in any of the records, as a share of rated command.
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
        """What was measured, one of `SENSORS`."""
        return SENSORS[0] if "pressure" in self.sensors else SENSORS[1]


@dataclass(frozen=True)
class Named:
    """An effect in `which.effects`, with its sizes by parameter, SI."""

    id: str
    probability: float
    sizes: Mapping[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True)
class Tried:
    """A set in `which.candidates`; score and costs in nats, None where the file lacks a cost."""

    effects: tuple[str, ...]
    score: float
    fitted_cost: float | None = None
    held_out_cost: float | None = None
    free: int | None = None


@dataclass(frozen=True)
class Said:
    """The parts of a diagnosis file that scoring uses.

    Attributes
    ----------
    verdict
        one of the six verdicts, or `FAILED`.
    named, sets, tried, cannot_judge
        named effects, ambiguity set, candidates and effects not judged, from `which`.
    subsystem
        shares of the subsystems, from `where`.
    residuals
        for each equation its subsystem, and its residual over the noise.
    calibration
        calibrated values by full name.
    gap
        gap of the calibrated rig over the middle of its noise floor; None where it is not known.
    of_explainable, from_nominal
        shrinkage on held-out data.
    seconds
        time that the diagnosis took, s.
    settings
        settings of the diagnosis.
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
    """Reads the answers, by name of the case.

    Raises
    ------
    ValueError
        there is no such file, or it is not one of a check.
    """
    plain = _read(path)
    return {name: _parsed(path, name, one, _answer) for name, one in sorted(plain.items())}


def read_said(folder: Path) -> Said | None:
    """Reads the result of a case; returns None where it has not been diagnosed yet."""
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
