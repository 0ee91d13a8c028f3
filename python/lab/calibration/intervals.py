# SPDX-License-Identifier: MIT
"""Whether 90 % intervals hold what they promise, and by how much they must be wider.

An interval of a fit knows the scatter over the windows of one machine, but not by how much machines
differ from the simulator. Its ends therefore move outwards by

    Q = the k-th smallest of n distances of the truth beyond this end, k = ceil((n + 1) 0.95),

so that the interval of a further machine holds the truth with a probability of at least 90 %, if
the machines are exchangeable (Y. Romano, E. Patterson, E. Candès, Conformalized quantile
regression, NeurIPS 2019). A distance of a truth inside the interval is negative, and so may Q be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.diagnosis.schema import Estimate

from ..scoring.figures import Figure, share
from ..scoring.reading import SENSORS
from ..scoring.tables import TARGETS
from .conformal import threshold_of
from .machines import MEASURES, Machine

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
    """Intervals of one kind.

    Attributes
    ----------
    words
        what they are intervals of.
    in_use
        share of the intervals, as the diagnosis gives them, that hold the truth.
    low, high
        distances Q by which their ends move outwards: of sizes, share of the size; of shrinkage,
        shrinkage. Infinite where there are too few machines.
    corrected
        share of the intervals with ends that other machines have moved.
    """

    words: str
    in_use: Figure
    low: float
    high: float
    corrected: Figure


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
