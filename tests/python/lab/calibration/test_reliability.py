# SPDX-License-Identifier: MIT
"""Probabilities that are meant have a small calibration error, and others a large one."""

from __future__ import annotations

import numpy as np
import pytest
from made_machines import machine

from ehsid.lab.calibration.fitting import ranked
from ehsid.lab.calibration.reliability import (
    TARGET,
    Claims,
    expected_error,
    first_answers,
    named_effects,
    reliability,
)

COUNT = 2000


def claims(power: float, seed: int) -> Claims:
    """Claims of probabilities p; the odds of the truth are those of p to this power."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(0.5, 1.0, COUNT)
    odds = (p / (1.0 - p)) ** power
    return Claims(p, rng.random(COUNT) < odds / (1.0 + odds), np.arange(COUNT))


@pytest.mark.thorough
def test_probabilities_that_are_meant_are_within_their_band() -> None:
    found = [reliability("", claims(1.0, seed)) for seed in range(10)]
    # The band holds 95 of 100: of ten, four outside of it has a chance of 1e-3.
    assert sum(one.error.value > one.meant_most for one in found) < 4
    assert np.mean([one.error.value for one in found]) == pytest.approx(found[0].meant, rel=0.3)


def test_the_overconfident_are_found_out() -> None:
    found = reliability("", claims(0.3, 0))
    assert found.error.value > 3.0 * found.meant_most
    assert found.error.low > TARGET.most
    assert found.error.met == "missed"


def test_the_error_is_that_of_its_definition() -> None:
    # 40 claims are two bins of 20: |0.5 - 0.25| and |0.9 - 1| in the mean.
    chances = np.repeat([0.5, 0.9], 20)
    true = np.arange(40) % 4 == 0
    true[20:] = True
    assert expected_error(chances, true) == pytest.approx(0.5 * (0.25 + 0.1))


def test_groups_have_equal_numbers_and_rising_probabilities() -> None:
    bins = reliability("", claims(1.0, 1)).bins
    assert [group.true.n for group in bins] == [COUNT // 10] * 10
    assert np.all(np.diff([group.probability for group in bins]) > 0.0)


@pytest.mark.thorough
def test_the_interval_knows_that_claims_of_a_machine_go_together() -> None:
    single = claims(0.5, 2)
    grouped = Claims(single.chances, single.true, np.arange(COUNT) // 20)
    for one in (reliability("", single), reliability("", grouped)):
        assert one.error.low <= one.error.value <= one.error.high
    # Twenty equal claims of each machine: the interval is wider by sqrt(20) = 4.5 in the mean.
    repeated = Claims(
        np.repeat(single.chances[:100], 20),
        np.repeat(single.true[:100], 20),
        np.repeat(np.arange(100), 20),
    )
    alone = Claims(repeated.chances, repeated.true, np.arange(COUNT))
    wide, narrow = (reliability("", one).error for one in (repeated, alone))
    assert wide.high - wide.low > 2.0 * (narrow.high - narrow.low)


def test_without_claims_there_is_no_figure() -> None:
    found = reliability("none", named_effects([]))
    assert found.error.n == 0
    assert found.error.met == "no data"


def test_both_laws_of_friction_are_one_answer_and_one_effect() -> None:
    laws = ("coulomb_friction",), ("stribeck_friction",)
    one = machine(("stribeck_friction",), *laws, ("transport_delay",))
    (answers,) = ranked([one], np.array([[0.1, 0.3, 0.3, 0.2, 0.1]]))
    assert answers.effects[0] == ("coulomb_friction",)
    assert answers.chances == pytest.approx([0.6, 0.2, 0.1, 0.1])
    assert answers.true.tolist() == [True, False, False, False]
    assert answers.effect_chances() == [(pytest.approx(0.6), True)]


def test_effects_have_the_probability_of_all_sets_with_them() -> None:
    one = machine(
        ("transport_delay", "sensor_backlash"),
        ("transport_delay", "sensor_lag"),
        ("transport_delay", "sensor_backlash"),
        kind="two",
    )
    (answers,) = ranked([one], np.array([[0.1, 0.5, 0.3, 0.1]]))
    assert answers.effect_chances() == [(pytest.approx(0.8), True), (pytest.approx(0.5), False)]
    assert answers.above_truth == pytest.approx(0.5)
    first = first_answers([answers])
    assert (first.chances.tolist(), first.true.tolist()) == ([0.5], [False])
