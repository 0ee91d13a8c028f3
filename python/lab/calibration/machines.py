# SPDX-License-Identifier: MIT
"""A machine as the calibration sees it: its weighed sets of effects, and which of them is true.

Reads the finished cases of checks as machines for the calibration.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from ehsid.harness.base.exchange import sha256_of
from ehsid.harness.base.parallel import Progress, run_tasks
from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.diagnosis.search.maps import QUANTISATION

from ..blind.making import ANSWERS, RESULTS, SEAL, Answer, Kind, read_answers, read_seal
from ..scoring.baselines import promises, transfer_of
from ..scoring.figures import effect_errors
from ..scoring.findings import FAILED, read_findings
from ..scoring.judging import HEALTHY, KNOWN, SENSORS, ScoredCase, is_exactly, judge

# Measures of the shrinkage of the gap: of the explainable gap, and from the rig as configured.
Measure = Literal["of_explainable", "from_nominal"]
MEASURES: tuple[Measure, ...] = get_args(Measure)


@dataclass(frozen=True)
class WeighedSet:
    """A set of effects that the decision weighed; its numbers are those of its `Hypothesis`."""

    effects: tuple[str, ...]
    left: float
    small: float
    price: float = 0.0
    """0 in a file of a version in which values of the rig had no price."""


@dataclass(frozen=True)
class Size:
    """A parameter of a rightly named effect: its estimate with a 90 % interval, and its truth."""

    effect: str
    parameter: str
    estimate: Estimate
    true: float


@dataclass(frozen=True)
class Promised:
    """Shrinkage by one measure: as promised, with its 90 % interval, and as realised."""

    measure: Measure
    predicted: Estimate
    realised: float


@dataclass(frozen=True)
class Machine:
    """A diagnosed machine whose truth is known; one line of `features.jsonl`."""

    name: str
    """Name of its case."""
    kind: Kind
    grade: str
    """As the generator names them."""
    measured: str
    """Class of its sensors, one of `scoring.reading.SENSORS`."""
    truth: tuple[str, ...]
    """Ids of its effects without those that the record itself decides; the set that is wanted."""
    sets: tuple[WeighedSet, ...]
    """Weighed sets of effects; the empty set is one of them."""
    families: Mapping[str, str] = field(default_factory=dict)
    """Kinds of physics, measurement and excitation by trait."""
    sizes: tuple[Size, ...] = ()
    promises: tuple[Promised, ...] = ()
    """What became of the intervals of sizes and of the promised shrinkage."""

    def __post_init__(self) -> None:
        problem = self._problem()
        if problem:
            raise ValueError(problem)

    def _problem(self) -> str | None:
        if self.measured not in SENSORS:
            return f"measured: '{self.measured}', expected one of {', '.join(SENSORS)}"
        if not any(not each.effects for each in self.sets):
            return "sets: the set without effects is missing; expected the one of the fitted rig"
        for each in self.sets:
            unknown = [effect for effect in each.effects if effect not in catalogue()]
            if unknown:
                return f"sets: '{unknown[0]}' is no effect of the catalogue of this version"
            if not (0.0 <= each.left < math.inf and 0.0 <= each.small < math.inf):
                return f"sets: left {each.left:g}, small {each.small:g}: expected finite, >= 0"
            if not math.isfinite(each.price):
                return f"sets: price {each.price:g}: expected finite"
        return None

    @property
    def pressures(self) -> bool:
        """Whether chamber pressures are measured."""
        return self.measured == SENSORS[0]

    @property
    def traits(self) -> dict[str, str]:
        """The families, and the grade as one more."""
        return {"grade": self.grade, **self.families}

    @property
    def left_by_none(self) -> float:
        """Errors that the calibrated rig leaves without any effect."""
        return next(each.left for each in self.sets if not each.effects)

    @property
    def true_sets(self) -> tuple[bool, ...]:
        """Whether each of the sets is the truth, by the rules of `scoring.judging`."""
        if self.kind in KNOWN or self.kind in HEALTHY:
            return tuple(is_exactly(each.effects, self.truth) for each in self.sets)
        return (False,) * len(self.sets)

    @property
    def outside(self) -> bool:
        """Whether "outside of the catalogue" is the right answer, as none of the sets is true."""
        return not any(self.true_sets)


# Digits of a number in the file of features: more are below the accuracy of the fits.
DIGITS = 5
# Why a case is left out.
NOT_FINISHED = "not finished"
NO_PROBABILITIES = "without probabilities"
INSUFFICIENT = "insufficient_data"


@dataclass(frozen=True)
class Found:
    """Machines of checks, and the number of cases that were left out, by reason."""

    machines: tuple[Machine, ...] = ()
    left_out: dict[str, int] = field(default_factory=dict)


def read_checks(folders: Sequence[Path], progress: Progress | None = None) -> Found:
    """Reads the finished cases of the folders of checks, and computes the realised shrinkage.

    Parameters
    ----------
    folders
        folders that `ehsid gap-check --out` made; a check that still runs may be one of them.
    progress
        called with the share of the cases that is done.

    Raises
    ------
    ValueError
        a folder holds no check, its answers were changed since they were sealed, or a file of it
        cannot be read.
    """
    tasks = [
        functools.partial(read_case, out, name, answer)
        for out in folders
        for name, answer in _sealed_answers(out).items()
    ]
    cases = run_tasks(tasks, progress) if tasks else []
    left_out: dict[str, int] = {}
    for case in cases:
        if isinstance(case, str):
            left_out[case] = left_out.get(case, 0) + 1
    return Found(tuple(case for case in cases if isinstance(case, Machine)), left_out)


def distinct(machines: Iterable[Machine]) -> list[Machine]:
    """Returns the machines in the order of their names, on which no result depends otherwise.

    Raises
    ------
    ValueError
        a machine occurs twice: it would be among those that are fitted and those that are tested.
    """
    ordered = sorted(machines, key=lambda machine: machine.name)
    for one, other in itertools.pairwise(ordered):
        if one.name == other.name:
            raise ValueError(
                f"machine {one.name}: given twice; expected each machine once: name each check and "
                "each file of features once, and no file beside the check that it was made from"
            )
    return ordered


def _sealed_answers(out: Path) -> dict[str, Answer]:
    seal = read_seal(out)
    answers = read_answers(out / ANSWERS)
    if sha256_of(out / ANSWERS) != seal.answers_sha256:
        raise ValueError(
            f"{out / ANSWERS}: differs from the digest in {SEAL}: expected the answers that were "
            "sealed; restore the file"
        )
    return answers


def read_case(out: Path, name: str, answer: Answer) -> Machine | str:
    """Returns the machine of a case, or the reason why the case is left out.

    Raises
    ------
    ValueError
        a file of the case cannot be read.
    """
    findings = read_findings(out / RESULTS / name)
    if findings is None:
        return NOT_FINISHED
    if findings.verdict in (FAILED, INSUFFICIENT):
        return findings.verdict
    sets = tuple(
        WeighedSet(
            each.effects, _rounded(each.left), _rounded(each.small), _rounded(each.price or 0.0)
        )
        for each in findings.candidates
        if each.probability is not None and each.left is not None and each.small is not None
    )
    if not sets:
        return NO_PROBABILITIES
    try:
        transfer = transfer_of(out, name, findings)
    except ValueError as error:
        # Errors of records and rigs cannot return from another process; a plain ValueError can.
        raise ValueError(f"case {name}: {error}") from None
    case = ScoredCase(name, answer, findings, judge(answer, findings), transfer)
    return Machine(
        name=name,
        kind=answer.kind,
        grade=answer.grade,
        measured=case.measured,
        # The record itself decides on quantisation; sets of effects have no part in it.
        truth=tuple(effect for effect in answer.effects if effect != QUANTISATION),
        sets=sets,
        families={"excitation": "+".join(sorted(answer.excitation)), **answer.families},
        sizes=tuple(
            Size(error.of, error.parameter, _of(error.estimate), _rounded(error.true))
            for error in effect_errors([case])
            if error.of != QUANTISATION and _is_finite(error.estimate)
        ),
        promises=tuple(
            Promised(measure, _of(promise.predicted), _rounded(promise.realised.value))
            for measure, of in zip(MEASURES, promises([case]), strict=True)
            for promise in of.each
            if _is_finite(promise.predicted) and math.isfinite(promise.realised.value)
        ),
    )


def _is_finite(estimate: Estimate) -> bool:
    return all(map(math.isfinite, (estimate.value, estimate.low, estimate.high)))


def _of(estimate: Estimate) -> Estimate:
    return Estimate(_rounded(estimate.value), _rounded(estimate.low), _rounded(estimate.high))


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
