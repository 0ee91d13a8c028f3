# SPDX-License-Identifier: MIT
"""Whether 90 % intervals hold what they promise, and by how much they must be wider.

An interval of a fit knows the scatter over the windows of one machine, but not by how much machines
differ from the simulator. Its ends therefore move outwards by

    Q = the k-th smallest of n distances of the truth beyond this end, k = ceil((n + 1) 0.95),

so that the interval of a further machine holds the truth with a probability of at least 90 %, if
the machines are exchangeable (Y. Romano, E. Patterson, E. Candès, Conformalized quantile
regression, NeurIPS 2019). A distance of a truth inside the interval is negative, and so may Q be.

Sets of answers that hold the truth with a promised frequency, by class of sensors.

The conformity score of a machine is the probability of all answers that are more probable than its
truth. A set has the answers, most probable first, before which all answers together have at most
the threshold (Y. Romano, M. Sesia, E. Candès, Classification with valid and adaptive coverage,
NeurIPS 2020, with u = 0, which never gives an empty set). The threshold is the k-th smallest score
of n machines, k = ceil((n + 1) level). Then the set of a further machine holds its truth with at
least this probability, if all machines are exchangeable. Each class of sensors has its own
threshold, so that the promise holds in each (V. Vovk, Conditional validity of inductive conformal
predictors, ACML 2012).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.diagnosis.schema import Estimate

from ..scoring.figures import Figure, Range, mean, share
from ..scoring.judging import SENSORS
from ..scoring.tables import TARGETS
from .choices import Choices, IntArray, probabilities
from .fitting import Ranked, fit, ranked
from .machines import MEASURES, Machine

# Promised frequencies: those that a check wants of the sets that are returned.
LEVELS: dict[str, float] = {name: TARGETS["in_set"][name].least for name in SENSORS}


@dataclass(frozen=True)
class ClassOfSensors:
    """Sets of the machines with the same sensors."""

    measured: str
    """Class of the sensors."""
    level: float
    """Promised frequency."""
    threshold: float
    """Threshold from all machines; infinite where there are too few of them for the level."""
    coverage: Figure
    """Share of the machines whose set holds the truth; each was left out of the fit and of the
    threshold."""
    size: Figure
    """Mean number of answers in a set."""


def threshold_of(scores: Sequence[float], level: float) -> float:
    """Returns the k-th smallest score, k = ceil((n + 1) level); infinite where k > n."""
    # Rounding of the product must not raise k: 20 x 0.95 is 19.
    k = math.ceil((len(scores) + 1) * level - 1e-9)
    return sorted(scores)[k - 1] if k <= len(scores) else math.inf


def thresholds(each: Sequence[Ranked]) -> dict[str, float]:
    """Returns the threshold of each class of sensors."""
    return {
        measured: threshold_of(
            [one.above_truth for one in each if one.machine.measured == measured], level
        )
        for measured, level in LEVELS.items()
    }


def holds(one: Ranked, limits: Mapping[str, float]) -> bool:
    """Whether the set of a machine holds its truth."""
    return one.above_truth <= limits[one.machine.measured]


def size(one: Ranked, limits: Mapping[str, float]) -> int:
    """Number of answers in the set of a machine."""
    return one.count_up_to(limits[one.machine.measured])


def split_sets(
    machines: Sequence[Machine], choices: Choices, parts: Sequence[IntArray]
) -> list[tuple[Ranked, bool, int]]:
    """Returns for each machine its answers, whether its set holds the truth, and the set's size.

    Each part is tested in turn. Half of the others serve the fit, and the other half the threshold.
    So the machine that is tested, those of the threshold and the fit are independent.
    """
    found = []
    for i in range(len(parts)):
        others = [*parts[i + 1 :], *parts[:i]]
        half = len(others) // 2
        constants = fit(choices.of(np.concatenate(others[:half]))).constants
        answers = ranked(machines, probabilities(choices, constants))
        limits = thresholds([answers[j] for j in np.concatenate(others[half:])])
        tested = [answers[j] for j in parts[i]]
        found += [(one, holds(one, limits), size(one, limits)) for one in tested]
    return found


def classes_of_sensors(
    sets: Sequence[tuple[Ranked, bool, int]], out_of_fold: Sequence[Ranked]
) -> tuple[ClassOfSensors, ...]:
    """Returns the coverage for each class; `out_of_fold` gives the thresholds from all machines."""
    limits = thresholds(out_of_fold)
    return tuple(
        ClassOfSensors(
            measured,
            level,
            limits[measured],
            share(
                "truth in the set",
                [inside for one, inside, _ in sets if one.machine.measured == measured],
                Range(least=level),
            ),
            mean(
                "answers in the set, mean",
                [float(count) for one, _, count in sets if one.machine.measured == measured],
                target=TARGETS["set_size"][measured],
            ),
        )
        for measured, level in LEVELS.items()
    )


WORDS = {
    "of_explainable": "shrinkage of the explainable gap",
    "from_nominal": "shrinkage from the simulator as configured",
}
# One end of an interval of 90 % is passed in 5 %.
LEVEL_OF_AN_END = 0.95
# Every machine is tested with ends from the machines of the other parts.
PARTS = 5


@dataclass(frozen=True)
class IntervalKind:
    """Intervals of one kind."""

    words: str
    """What they are intervals of."""
    in_use: Figure
    """Share of the intervals, as the diagnosis gives them, that hold the truth."""
    low: float
    high: float
    """Distances Q by which their ends move outwards: of sizes, share of the size; of shrinkage,
    shrinkage. Infinite where there are too few machines."""
    corrected: Figure
    """Share of the intervals with ends that other machines have moved."""


@dataclass(frozen=True)
class Intervals:
    """Intervals over the machines with the same sensors."""

    measured: str
    each: tuple[IntervalKind, ...]


def intervals(machines: Sequence[Machine]) -> tuple[Intervals, ...]:
    """Returns, for each class of sensors, intervals of sizes and of each measure of shrinkage."""
    return tuple(
        Intervals(measured, _kinds([one for one in machines if one.measured == measured]))
        for measured in SENSORS
    )


def _kinds(machines: Sequence[Machine]) -> tuple[IntervalKind, ...]:
    sizes = [
        [_beyond(size.estimate, size.true, abs(size.estimate.value) or 1.0) for size in one.sizes]
        for one in machines
    ]
    return (
        _kind("sizes of effects", sizes),
        *(
            _kind(
                WORDS[measure],
                [
                    [
                        _beyond(promise.predicted, promise.realised, 1.0)
                        for promise in one.promises
                        if promise.measure == measure
                    ]
                    for one in machines
                ],
            )
            for measure in MEASURES
        ),
    )


def _beyond(estimate: Estimate, true: float, unit: float) -> tuple[float, float]:
    """Distances of the truth beyond both ends of an interval, negative inside."""
    return (estimate.low - true) / unit, (true - estimate.high) / unit


def _kind(words: str, by_machine: Sequence[Sequence[tuple[float, float]]]) -> IntervalKind:
    target = TARGETS["coverage"][SENSORS[0]]
    rows = np.array([pair for pairs in by_machine for pair in pairs]).reshape(-1, 2)
    # Intervals of one machine are not independent of each other: they stay in one part.
    part = np.array([i % PARTS for i, pairs in enumerate(by_machine) for _ in pairs], dtype=int)
    corrected: list[bool] = []
    for number in range(PARTS):
        ends = _ends(rows[part != number])
        corrected += np.all(rows[part == number] <= ends, axis=1).tolist()
    low, high = _ends(rows).tolist()
    return IntervalKind(
        words,
        share("as given", np.all(rows <= 0.0, axis=1).tolist(), target),
        low,
        high,
        share("with moved ends", corrected, target),
    )


def _ends(rows: FloatArray) -> FloatArray:
    """Distances Q of both ends, shape (2,), from distances of truths beyond them, shape (n, 2)."""
    return np.array([threshold_of(column.tolist(), LEVEL_OF_AN_END) for column in rows.T])
