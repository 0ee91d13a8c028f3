# SPDX-License-Identifier: MIT
"""Sets of answers that hold the truth with a promised frequency, by class of sensors.

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

from ..scoring.figures import Figure, Range, mean, share
from ..scoring.reading import SENSORS
from ..scoring.tables import TARGETS
from .choices import Choices, IntArray, probabilities
from .fitting import fit
from .machines import Machine
from .ranking import Ranked, ranked

# Promised frequencies: those that a check wants of the sets that are returned.
LEVELS: dict[str, float] = {name: TARGETS["in_set"][name].least for name in SENSORS}


@dataclass(frozen=True)
class ClassOfSensors:
    """Sets of the machines with the same sensors.

    Attributes
    ----------
    measured
        class of the sensors.
    level
        promised frequency.
    threshold
        threshold from all machines; infinite where there are too few of them for the level.
    coverage
        share of the machines whose set holds the truth; each was left out of the fit and of the
        threshold.
    size
        mean number of answers in a set.
    """

    measured: str
    level: float
    threshold: float
    coverage: Figure
    size: Figure


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
