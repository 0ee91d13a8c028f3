# SPDX-License-Identifier: MIT
"""Reads what the diagnosis found in a case of a check."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ehsid.harness.diagnosis.schema import (
    Candidate,
    CouldBeSeen,
    DiagnosisFile,
    Estimate,
    HowFar,
    read_diagnosis_file,
)

from .contradictions import contradictions

FAILED = "failed"  # in place of a verdict, where the diagnosis raised an error


@dataclass(frozen=True)
class NamedEffect:
    """An effect in `which.effects`, with its sizes by parameter, SI."""

    id: str
    probability: float
    sizes: Mapping[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True)
class Findings:
    """The parts of a diagnosis file that scoring uses."""

    verdict: str
    """One of the six verdicts, or `FAILED`."""
    named: tuple[NamedEffect, ...] = ()
    sets: tuple[tuple[str, ...], ...] = ()
    candidates: tuple[Candidate, ...] = ()
    cannot_judge: frozenset[str] = frozenset()
    """Named effects, ambiguity set, candidates and effects not judged, from `which`."""
    could_be_seen: tuple[CouldBeSeen, ...] = ()
    """From which size on the records would have shown the effects that are not named."""
    laws: tuple[tuple[str, str], ...] = ()
    """Equation and variable of each law without a name that was found."""
    subsystem: Mapping[str, float] = field(default_factory=dict)
    """Shares of the subsystems, from `where`."""
    equations: tuple[tuple[str, float], ...] = ()
    """For each equation its subsystem, and the gain of terms in it, nats."""
    calibration: Mapping[str, Estimate] = field(default_factory=dict)
    """Calibrated values by full name."""
    moved: bool = False
    """Whether any value differs from the rig file."""
    gap: float | None = None
    """Gap of the calibrated rig over the middle of its noise floor; None where it is not known."""
    of_explainable: Estimate | None = None
    from_nominal: Estimate | None = None
    """Shrinkage on held-out data."""
    seconds: float = math.nan
    """Time that the diagnosis took, s."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the diagnosis."""
    contradictions: tuple[str, ...] = ()
    """Rules that the statements of the diagnosis break; none where it is consistent."""


def read_findings(folder: Path) -> Findings | None:
    """Reads the result of a case; returns None where it has not been diagnosed yet."""
    if (folder / "diagnosis.json").is_file():
        return _findings(read_diagnosis_file(folder / "diagnosis.json"))
    return Findings(FAILED) if (folder / "error.txt").is_file() else None


def _findings(file: DiagnosisFile) -> Findings:
    which, how_far = file.which, file.how_far
    return Findings(
        verdict=file.verdict,
        named=tuple(
            NamedEffect(
                effect.id,
                effect.probability,
                effect.parameters,
            )
            for effect in which.effects
        ),
        sets=which.ambiguity_set,
        candidates=which.candidates,
        cannot_judge=frozenset(effect.id for effect in which.cannot_judge),
        could_be_seen=which.could_be_seen,
        laws=tuple((law.law.adds_to, law.law.of) for law in which.missing_law),
        subsystem=file.where.subsystem,
        equations=tuple(
            (equation.subsystem, equation.gain)
            for equation in file.where.equations
            if math.isfinite(equation.gain)
        ),
        calibration={name: value.found for name, value in file.calibration.items()},
        moved=any(value.moved for value in file.calibration.values()),
        gap=_gap(how_far),
        of_explainable=how_far.of_explainable,
        from_nominal=_finite(how_far.from_nominal),
        seconds=file.provenance.seconds,
        settings=file.provenance.settings,
        contradictions=contradictions(file),
    )


def _finite(value: Estimate) -> Estimate | None:
    return value if math.isfinite(value.value) else None


def _gap(how_far: HowFar) -> float | None:
    ends = [end for end in how_far.noise_floor if end > 0.0]
    if math.isnan(how_far.calibrated) or not ends:
        return None
    return how_far.calibrated * len(ends) / sum(ends)
