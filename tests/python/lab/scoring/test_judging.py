# SPDX-License-Identifier: MIT
"""What counts as right, all of it as a table."""

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.catalogue.families import spelled_out
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.lab.blind.making import Answer
from ehsid.lab.scoring.findings import FAILED, Findings, NamedEffect
from ehsid.lab.scoring.judging import NEAR, is_exactly, is_true, judge

BAND, BIAS, DELAY = "valve_dead_band", "valve_null_bias", "transport_delay"
COULOMB, STRIBECK = "coulomb_friction", "stribeck_friction"
LINKAGE_LAWS = (("force", "position_m"), ("mass", "position_m"))
TRUTHS = {
    "one": (BAND,),
    "two": (BAND, DELAY),
    "none": (),
    "params": (),
    "open": ("valve_stiction",),
}
VERDICTS = (
    "effects",
    "ambiguous",
    "outside_catalogue",
    "parameters",
    "no_gap",
    "insufficient_data",
)


def answer(kind: str, *truth: str, grade: str = "plain") -> Answer:
    told = truth or TRUTHS[kind]
    subsystems = tuple(effects()[one].subsystem if one in effects() else "valve" for one in told)
    return Answer(kind, grade, "ehs", "position", ("prbs",), {one: {} for one in told}, subsystems)


def findings(
    verdict: str,
    *named: str,
    sets: tuple[tuple[str, ...], ...] = (),
    silent: tuple[str, ...] = (),
    subsystem: str = "",
) -> Findings:
    return Findings(
        verdict,
        tuple(NamedEffect(one, 0.9) for one in named),
        sets,
        cannot_judge=frozenset(silent),
        subsystem={subsystem: 0.8, "sensor": 0.1} if subsystem else {},
    )


# kind, what was said, outcome
TABLE = [
    ("one", findings("effects", BAND), "right"),
    ("one", findings("effects", BAND, BIAS), "incomplete"),
    ("one", findings("effects", BIAS, BAND), "wrong name"),
    ("one", findings("effects", BIAS), "wrong name"),
    ("one", findings("ambiguous", BIAS, sets=((BIAS,), (BAND,))), "right"),
    ("one", findings("ambiguous", BAND, sets=((BAND,), (BIAS,))), "right"),
    ("one", findings("ambiguous", BIAS, sets=((BIAS,), (DELAY,))), "set without the truth"),
    ("one", findings("ambiguous", BIAS, sets=((BIAS,), (BAND, DELAY))), "set without the truth"),
    ("one", findings("outside_catalogue"), "rejected"),
    ("one", findings("outside_catalogue", BAND), "rejected"),
    ("one", findings("no_gap"), "missed"),
    ("one", findings("no_gap", silent=(BAND, BIAS)), "abstained"),
    ("one", findings("insufficient_data", silent=(BAND,)), "abstained"),
    ("one", findings("parameters", silent=(BAND,)), "missed"),
    ("one", findings("insufficient_data"), "missed"),
    ("two", findings("effects", BAND, DELAY), "right"),
    ("two", findings("effects", DELAY, BAND), "right"),
    ("two", findings("effects", BAND), "incomplete"),
    ("two", findings("effects", DELAY, BIAS), "incomplete"),
    ("two", findings("effects", BIAS, BAND), "wrong name"),
    ("two", findings("effects", BAND, DELAY, BIAS), "incomplete"),
    ("two", findings("ambiguous", BAND, BIAS, sets=((BAND, BIAS), (BAND, DELAY))), "right"),
    ("two", findings("ambiguous", BAND, sets=((BAND,), (BIAS,))), "set without the truth"),
    ("two", findings("no_gap", silent=(BAND,)), "missed"),
    ("two", findings("no_gap", silent=(BAND, DELAY)), "abstained"),
    ("two", findings("parameters"), "missed"),
    ("two", findings("insufficient_data", silent=(DELAY,)), "missed"),
    ("two", findings("outside_catalogue", BAND), "rejected"),
    ("none", findings("no_gap"), "right"),
    ("none", findings("parameters"), "right"),
    ("none", replace(findings("parameters"), moved=True), "other verdict"),
    ("none", findings("insufficient_data"), "other verdict"),
    ("none", findings("effects", BAND), "false alarm"),
    ("none", findings("ambiguous", BAND, sets=((BAND,), (BIAS,))), "false alarm"),
    ("none", findings("outside_catalogue"), "false alarm"),
    ("params", findings("parameters"), "right"),
    ("params", findings("no_gap"), "other verdict"),
    ("params", findings("insufficient_data"), "other verdict"),
    ("params", findings("effects", BAND), "false alarm"),
    ("params", findings("ambiguous", BAND, sets=((BAND,), (BIAS,))), "false alarm"),
    ("params", findings("outside_catalogue", BAND), "false alarm"),
    ("open", findings("outside_catalogue"), "right"),
    ("open", findings("outside_catalogue", BAND), "right"),
    ("open", findings("effects", BAND), "wrong name"),
    ("open", findings("ambiguous", BAND, sets=((BAND,), (BIAS,))), "set without the truth"),
    ("open", findings("parameters"), "missed"),
    ("open", findings("no_gap"), "missed"),
    ("open", findings("insufficient_data"), "missed"),
    *((kind, Findings(FAILED), "failed") for kind in TRUTHS),
]


def test_the_table_has_every_kind_with_every_verdict() -> None:
    covered = {(kind, one.verdict) for kind, one, _ in TABLE}
    assert covered == set(itertools.product(TRUTHS, (*VERDICTS, FAILED)))


@pytest.mark.parametrize("grade", ["plain", "hard", "confusable"])
@pytest.mark.parametrize(("kind", "what", "outcome"), TABLE)
def test_outcomes(kind: str, what: Findings, outcome: str, grade: str) -> None:
    found = judge(answer(kind, grade=grade), what)
    assert found.outcome == outcome
    assert found.right == (outcome == "right")


@pytest.mark.parametrize(("kind", "what", "outcome"), TABLE)
def test_questions_arise_only_where_they_can(kind: str, what: Findings, outcome: str) -> None:
    found = judge(answer(kind), what)
    known, healthy = kind in ("one", "two"), kind in ("none", "params")
    for name in ("effect_first", "exact", "in_set", "rejected", "abstained"):
        assert (getattr(found, name) is not None) == known
    assert (found.recognised is not None) == (kind == "open")
    assert (found.false_effect is not None) == (found.false_alarm is not None) == healthy
    assert (found.wrong_name is not None) == (found.subsystem_first is not None) == (not healthy)
    # What the outcome says and what is counted must agree.
    assert bool(found.wrong_name) == (outcome == "wrong name")
    assert bool(found.false_alarm) == (outcome == "false alarm")
    assert bool(found.rejected) == (outcome == "rejected")
    assert bool(found.abstained) == (outcome == "abstained")
    assert bool(found.recognised) == (kind == "open" and outcome == "right")
    if known and outcome == "right":
        assert found.in_set


def test_the_first_name_counts_whatever_the_verdict() -> None:
    found = judge(answer("one"), findings("outside_catalogue", BAND))
    assert found.effect_first
    assert found.exact
    assert found.in_set
    assert found.rejected
    assert not found.wrong_name


def test_the_first_name_of_a_set_is_no_confident_one() -> None:
    found = judge(answer("one"), findings("ambiguous", BIAS, sets=((BIAS,), (BAND,))))
    assert found.effect_first is False
    assert found.in_set
    assert found.set_size == 2
    assert not found.wrong_name


def test_unknown_effects_are_named_by_nobody() -> None:
    found = judge(answer("open", "warming_oil"), findings("effects", "warming_oil"))
    assert found.wrong_name
    assert not found.recognised


@pytest.mark.parametrize(("true", "near"), NEAR.items())
def test_an_effect_that_is_nearly_the_unknown_one_is_right(true: str, near: str) -> None:
    found = judge(answer("open", true), findings("effects", near))
    assert (found.outcome, found.recognised, found.wrong_name) == ("right", True, False)
    # So it is not beside another one, nor is its neighbour; and it is no name for another cause.
    for named, cause in (((near, BAND), true), ((COULOMB,), true), ((near,), "supply_ripple")):
        found = judge(answer("open", cause), findings("effects", *named))
        assert (found.outcome, found.recognised, found.wrong_name) == ("wrong name", False, True)
    assert judge(answer("open", true), findings("outside_catalogue")).recognised


def test_an_effect_beside_an_unknown_gap_is_blamed_all_the_same() -> None:
    found = judge(answer("none"), findings("outside_catalogue", BAND))
    assert found.false_effect
    assert not judge(answer("none"), findings("outside_catalogue")).false_effect


@pytest.mark.parametrize(
    ("true", "what", "outcome"),
    [
        (BAND, findings("outside_catalogue"), "right"),
        (BAND, findings("ambiguous", BIAS, sets=((BIAS,), (DELAY,))), "right"),
        (BAND, findings("effects", BIAS), "wrong name"),
        (BAND, findings("parameters"), "missed"),
        (BAND, findings("no_gap"), "missed"),
        (BAND, findings("insufficient_data"), "missed"),
        (COULOMB, findings("effects", STRIBECK), "right"),
        (BAND, Findings(FAILED), "failed"),
    ],
)
def test_without_the_true_effect(true: str, what: Findings, outcome: str) -> None:
    found = judge(answer("one", true), replace(what, settings={"effects_excluded": [true]}))
    assert found.outcome == outcome
    assert found.recognised == (what.verdict == "outside_catalogue")
    assert found.effect_first is None


@pytest.mark.parametrize(
    ("named", "true", "right"),
    [
        (COULOMB, STRIBECK, True),
        (STRIBECK, COULOMB, True),
        ("load_spring", "load_force", True),
        ("load_force", "load_spring", False),
        (BAND, BIAS, False),
    ],
)
def test_families(named: str, true: str, right: bool) -> None:
    assert is_true(named, [true]) == right
    assert judge(answer("one", true), findings("effects", named)).right == right


def test_the_subsystem_is_the_largest_share() -> None:
    assert judge(answer("one"), findings("effects", BIAS, subsystem="valve")).subsystem_first
    assert not judge(answer("one"), findings("effects", BAND, subsystem="timing")).subsystem_first
    assert not judge(answer("one"), findings("no_gap")).subsystem_first
    assert judge(answer("open"), findings("outside_catalogue", subsystem="valve")).subsystem_first
    # of two effects either is right
    assert judge(answer("two"), findings("effects", BAND, subsystem="timing")).subsystem_first


IDS = st.sampled_from(sorted(effects()))


@given(st.sets(IDS, min_size=1, max_size=3), st.randoms(use_true_random=False))
def test_the_truth_in_any_order_is_right(truth: set[str], random: object) -> None:
    order = sorted(truth, key=lambda _: random.random())  # type: ignore[attr-defined]
    assert is_exactly(order, sorted(truth))


def test_unequal_overlaps_are_a_dead_band_and_a_null_bias() -> None:
    sides = "valve_dead_band_sides"
    for truth, named in (((BAND, BIAS), (sides,)), ((sides,), (BIAS, BAND))):
        assert is_exactly(named, truth)
        assert all(is_true(one, truth) for one in named)
    assert not is_exactly([BAND], [sides])
    assert not is_true(sides, [BAND])


@pytest.mark.parametrize(
    ("offset", "exact"),
    [(0.008, True), (0.0054, True), (0.0053, False), (0.0121, False), (-0.008, False)],
)
def test_a_dead_band_whose_ends_differ_has_a_null_bias(offset: float, exact: bool) -> None:
    # The dead band is from -0.048 to 0.032 of the command: its middle is at -0.008.
    machine = replace(
        answer("one", BAND), effects={BAND: {"overlap": 0.04}}, variants={"lap_difference": -0.2}
    )
    sizes = {"offset": Estimate(offset, offset, offset)}
    both = Findings("effects", (NamedEffect(BAND, 0.9), NamedEffect(BIAS, 0.9, sizes)))
    assert judge(machine, both).exact == exact
    assert judge(machine, findings("effects", BAND)).exact
    equal = replace(machine, variants={})
    assert not judge(equal, both).exact


def test_a_spring_that_stands_for_a_force_covers_no_other_name() -> None:
    truth = {"coulomb_friction", "load_spring", "load_force"}
    assert not is_exactly({"entrained_air", "coulomb_friction", "load_spring"}, truth)


@given(st.sets(IDS, min_size=1, max_size=3), st.sets(IDS, min_size=1, max_size=3))
def test_what_is_exact_has_no_wrong_name_in_it(named: set[str], truth: set[str]) -> None:
    exact = is_exactly(named, truth)
    assert exact <= all(is_true(one, truth) for one in named)
    assert exact <= (len(spelled_out([*named])) == len(spelled_out([*truth])))
    assert is_exactly(truth, truth)


@pytest.mark.parametrize(
    ("truth", "verdict", "named", "laws", "outcome", "law", "beside"),
    [
        ((), "outside_catalogue", (), LINKAGE_LAWS, "right", True, True),
        ((), "outside_catalogue", ("load_spring",), (), "right", None, True),
        ((), "outside_catalogue", (BAND,), (("flow_a", "spool"),), "right", False, False),
        ((), "effects", ("load_force",), (), "incomplete", None, True),
        ((), "effects", (DELAY,), (), "wrong name", None, False),
        ((), "parameters", (), (), "missed", None, True),
        ((BAND,), "outside_catalogue", (BAND,), LINKAGE_LAWS[1:], "right", True, True),
        ((BAND,), "outside_catalogue", (), LINKAGE_LAWS, "right", True, False),
        ((BAND,), "effects", (BAND, "load_spring"), (), "incomplete", None, True),
        ((BAND,), "ambiguous", (BAND,), (), "incomplete", None, True),
        ((BAND,), "ambiguous", (DELAY,), (), "set without the truth", None, False),
    ],
)
def test_a_linkage_with_what_is_beside_it(
    truth: tuple[str, ...],
    verdict: str,
    named: tuple[str, ...],
    laws: tuple[tuple[str, str], ...],
    outcome: str,
    law: bool | None,
    beside: bool,
) -> None:
    told = replace(answer("open", *truth, "linkage"), laws=LINKAGE_LAWS)
    found = replace(findings(verdict, *named), laws=laws)
    judged = judge(told, found)
    assert (judged.outcome, judged.law, judged.beside) == (outcome, law, beside)
    assert judged.recognised == (verdict == "outside_catalogue")
    assert judged.wrong_name == (outcome == "wrong name")
