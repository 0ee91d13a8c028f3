# SPDX-License-Identifier: MIT
"""Sets hold the truth as often as they promise, in each class of sensors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_machines import TRUE, drawn_machines, machine
from scipy import stats

from ehsid.lab.calibration.choices import choices_of
from ehsid.lab.calibration.fitting import folds, ranked
from ehsid.lab.calibration.intervals import (
    LEVELS,
    classes_of_sensors,
    holds,
    size,
    split_sets,
    threshold_of,
)
from ehsid.lab.scoring.judging import SENSORS


@given(
    scores=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=60),
    level=st.sampled_from([0.5, 0.9, 0.95, 0.97]),
)
def test_the_threshold_is_the_least_that_enough_scores_do_not_exceed(
    scores: list[float], level: float
) -> None:
    threshold = threshold_of(scores, level)
    needed = math.ceil(round((len(scores) + 1) * level, 6))
    if needed > len(scores):
        assert math.isinf(threshold)
        return
    assert sum(score <= threshold for score in scores) >= needed
    assert sum(score < threshold for score in scores) < needed


def test_nineteen_scores_are_just_enough_for_a_level_of_95_per_cent() -> None:
    scores = np.linspace(0.0, 1.0, 19).tolist()
    assert threshold_of(scores, 0.95) == 1.0
    assert math.isinf(threshold_of(scores[1:], 0.95))


def test_exchangeable_scores_are_covered_as_promised() -> None:
    rng = np.random.default_rng(5)
    repeats, count = 4000, 59
    inside = [rng.random() <= threshold_of(rng.random(count).tolist(), 0.9) for _ in range(repeats)]
    # k = ceil(60 x 0.9) = 54 of 59 continuous scores: the coverage is exactly 54 / 60.
    low, high = stats.binom.interval(1.0 - 1e-3, repeats, 54.0 / 60.0)
    assert low <= sum(inside) <= high


@pytest.mark.thorough
def test_sets_of_machines_hold_their_truth_in_each_class_of_sensors() -> None:
    # Truths that no error shows, a share of LAPSE, are in a set of nearly all answers only. With
    # more evidence, errors of the others tell the truth from most answers.
    machines = drawn_machines(1000, 6, replace(TRUE, evidence=60.0, lapse=0.002))
    parts = folds(len(machines), 5, np.random.default_rng(0))
    found = classes_of_sensors(split_sets(machines, choices_of(machines), parts), [])
    assert [one.measured for one in found] == list(SENSORS)
    for one in found:
        level, n = LEVELS[one.measured], one.coverage.n
        # A threshold from m machines has a coverage with the variance level (1 - level) / (m + 2);
        # two of five parts are m = 0.4 n of them. The parts are tested beside different ones, so
        # this is the most that the variance of all five together can be.
        variance = level * (1.0 - level) * (1.0 / n + 1.0 / (0.4 * n + 2.0))
        assert one.coverage.value > level + stats.norm.ppf(1e-3 / 2.0) * math.sqrt(variance)
        # They are less than half of all answers, which are 8.4 in the mean.
        assert 1.0 <= one.size.value < 4.0


def test_a_class_without_enough_machines_gets_all_answers() -> None:
    few = [
        machine(("transport_delay",), ("transport_delay",), ("sensor_lag",), name=str(i))
        for i in range(10)
    ]
    chances = np.tile([0.1, 0.2, 0.3, 0.4], (10, 1))
    answers = ranked(few, chances)
    limits = {measured: threshold_of([0.0] * 10, LEVELS[measured]) for measured in SENSORS}
    assert all(holds(one, limits) for one in answers)
    assert {size(one, limits) for one in answers} == {4}


@pytest.mark.parametrize(
    ("threshold", "count", "inside"), [(0.0, 1, False), (0.45, 2, True), (0.8, 3, True)]
)
def test_a_set_has_the_answers_before_which_not_too_much_is_likely(
    threshold: float, count: int, inside: bool
) -> None:
    # Outside 0.4, lag 0.3 and so on: the truth, lag, is second.
    one = machine(("sensor_lag",), ("transport_delay",), ("sensor_lag",))
    (answers,) = ranked([one], np.array([[0.1, 0.2, 0.3, 0.4]]))
    limits = dict.fromkeys(SENSORS, threshold)
    assert size(answers, limits) == count
    assert holds(answers, limits) is inside
