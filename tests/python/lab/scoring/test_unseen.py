# SPDX-License-Identifier: MIT
"""Effects that are not named, against the size from which on a diagnosis says it would see them."""

import math

import pytest
from scored_cases import BAND, BIAS, findings

from ehsid.harness.diagnosis.schema import CouldBeSeen
from ehsid.lab.blind.making import Answer
from ehsid.lab.scoring.judging import ScoredCase, judge
from ehsid.lab.scoring.tables import figure_tables
from ehsid.lab.scoring.unseen import unseen_effects
from ehsid.lab.scoring.wrong import reasons


def missed(
    sizes: dict[str, dict[str, float]], *limits: CouldBeSeen, named: tuple[str, ...] = ()
) -> ScoredCase:
    answer = Answer("one", "plain", "ehs", "pressures", ("prbs",), sizes, ("valve",))
    found = findings(*named, could_be_seen=limits)
    return ScoredCase("a1", answer, found, judge(answer, found))


@pytest.mark.parametrize(
    ("effect", "name", "size", "limit", "over"),
    [
        (BIAS, "offset", -0.02, 0.01, 2.0),  # of either sign
        ("pressure_sensor_gain", "gain_a", 0.96, 1.08, 0.5),  # what is neutral is 1
        ("valve_lag", "bandwidth_hz", 40.0, 20.0, 0.5),  # a slower valve is the larger effect
    ],
)
def test_sizes_are_compared_as_the_outputs_depend_on_them(
    effect: str, name: str, size: float, limit: float, over: float
) -> None:
    case = missed({effect: {name: size}}, CouldBeSeen(effect, name, limit, "record"))
    [one] = unseen_effects(case)
    assert one.effect == effect
    assert one.over_limit == pytest.approx(over)
    assert ("no smaller" in one.told) == (over >= 1.0)
    assert one.told in reasons(case)


def test_an_effect_that_no_size_would_show_is_below_every_limit() -> None:
    limit = CouldBeSeen(BAND, "overlap", math.nan, "none")
    [one] = unseen_effects(missed({BAND: {"overlap": 0.5}}, limit))
    assert one.over_limit == 0.0


def test_only_what_is_not_named_and_has_a_limit_counts() -> None:
    limit = CouldBeSeen(BAND, "overlap", 0.1, "record")
    assert not unseen_effects(missed({BIAS: {"offset": 0.1}}, limit))
    assert not unseen_effects(missed({BAND: {"overlap": 0.1}}, limit, named=(BAND,)))
    found = findings(BIAS, sets=((BIAS,), (BIAS, BAND)), could_be_seen=(limit,))
    answer = Answer("one", "plain", "ehs", "pressures", ("prbs",), {BAND: {"overlap": 0.1}}, ())
    assert not unseen_effects(ScoredCase("a1", answer, found, judge(answer, found)))


def test_a_friction_law_is_named_by_another_one() -> None:
    limit = CouldBeSeen("coulomb_friction", "force_n", 9.0, "record")
    sizes = {"coulomb_friction": {"force_n": 5.0}}
    assert unseen_effects(missed(sizes, limit))
    assert not unseen_effects(missed(sizes, limit, named=("stribeck_friction",)))


def test_the_figures_count_the_effects_and_not_the_cases() -> None:
    limits = (
        CouldBeSeen(BIAS, "offset", 0.02, "record"),
        CouldBeSeen(BAND, "overlap", 0.02, "record"),
    )
    case = missed({BIAS: {"offset": 0.01}, BAND: {"overlap": 0.03}}, *limits)
    [figure] = (
        each
        for each in figure_tables([case])[0].columns["pressures"]
        if each.words == "not named: smaller than the page says it can see"
    )
    assert (figure.value, figure.n) == (0.5, 2)
