# SPDX-License-Identifier: MIT
"""Simpler ways read off the candidates; regret; reasons for errors."""

import math

import pytest
from statsmodels.tools.eval_measures import bic as bic_of

from ehsid.harness.validation.scoring.baselines import (
    baselines,
    best_fit,
    largest_residual,
    lowest_bic,
    refit_only,
)
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.reading import Answer, Named, Said, Tried
from ehsid.harness.validation.scoring.regret import behind_truth, regret_of
from ehsid.harness.validation.scoring.right import judge
from ehsid.harness.validation.scoring.wrong import reasons, wrong_cases

BAND, BIAS, LAG = "valve_dead_band", "valve_null_bias", "sensor_lag"
TRIED = (
    Tried((), 60.0, 100.0, 160.0, 12),
    Tried((BIAS,), 0.0, 41.0, 100.0, 13),
    Tried((BAND,), 4.0, 40.0, 104.0, 13),
    Tried((BAND, LAG), 9.0, 39.0, 109.0, 14),
)
N = 400.0


def case(said: Said, *truth: str, kind: str = "one", command: float = 0.5) -> Scored:
    sizes = {one: {"limit": 0.8} if one.endswith("saturation") else {} for one in truth}
    answer = Answer(
        kind, "plain", "ehs", "pressures", ("prbs",), sizes, ("valve",), largest_command=command
    )
    return Scored("a1", answer, said, judge(answer, said))


def said(*named: str, tried: tuple[Tried, ...] = TRIED, **more: object) -> Said:
    verdict = "effects" if named else "no_gap"
    return Said(verdict, tuple(Named(one, 0.9) for one in named), tried=tried, **more)  # type: ignore[arg-type]


def ids(found: Said | None) -> list[str]:
    assert found is not None
    return [one.id for one in found.named]


def test_best_fit_takes_the_lowest_cost_whatever_it_costs() -> None:
    assert ids(best_fit(case(said(BIAS), BIAS))) == [BAND, LAG]


def test_bic_is_half_that_of_statsmodels() -> None:
    subject = case(said(BIAS), BIAS)
    theirs = [bic_of(-one.fitted_cost, N, one.free) for one in TRIED if one.fitted_cost]
    best = TRIED[min(range(len(theirs)), key=theirs.__getitem__)]
    assert ids(lowest_bic({"a1": N})(subject)) == list(best.effects) == [BAND]


def test_bic_keeps_the_rig_alone_where_effects_gain_little() -> None:
    little = (Tried((), 0.0, 100.0, 1.0, 12), Tried((BAND,), 0.0, 98.0, 1.0, 13))
    found = lowest_bic({"a1": N})(case(said(BAND, tried=little), BAND))
    assert found is not None
    assert (found.verdict, found.named) == ("parameters", ())


def test_ways_without_what_they_need_say_nothing() -> None:
    bare = case(said(BIAS, tried=(Tried((BIAS,), 0.0),)), BIAS)
    assert best_fit(bare) is None
    assert lowest_bic({"a1": N})(bare) is None
    assert lowest_bic({"a1": None})(case(said(BIAS), BIAS)) is None
    assert largest_residual(bare) is None


def test_largest_residual_is_counted_in_its_noise() -> None:
    subject = case(said(BIAS, residuals=(("mechanics", 3.0), ("valve", 8.0))), BIAS)
    found = largest_residual(subject)
    assert found is not None
    assert judge(subject.answer, found).subsystem_first


def test_refit_only_never_blames_an_effect() -> None:
    found = refit_only(case(said(BAND), kind="none"))
    assert found is not None
    assert (found.verdict, found.named) == ("parameters", ())


def test_all_ways_stand_beside_each_other() -> None:
    cases = [case(said(BIAS), BIAS), case(said(BAND), kind="none")]
    table = {one.name: {f.words: f for f in one.figures} for one in baselines(cases, {"a1": N})}
    assert next(iter(table)) == "this diagnosis"
    assert table["this diagnosis"]["effect first"].value == 1.0
    assert table["best fit in sample"]["effect first"].value == 0.0
    assert table["best fit in sample"]["effect where there is none"].value == 1.0
    assert table["refit only"]["effect where there is none"].value == 0.0
    assert table["largest residual"]["subsystem first"].n == 0


@pytest.mark.parametrize(
    ("named", "truth", "nats"),
    [((BIAS,), (BIAS,), 0.0), ((BIAS,), (BAND,), -4.0), ((BAND, LAG), (BIAS,), 9.0)],
)
def test_regret_is_the_difference_on_held_out_data(
    named: tuple[str, ...], truth: tuple[str, ...], nats: float
) -> None:
    assert behind_truth(said(*named), truth) == pytest.approx(nats)
    only_scores = tuple(Tried(one.effects, one.score) for one in TRIED)
    assert behind_truth(said(*named, tried=only_scores), truth) == pytest.approx(nats)


def test_regret_counts_what_was_never_fitted() -> None:
    found = regret_of([case(said(BIAS), BIAS), case(said(BIAS), LAG)])
    assert (found.tried, found.not_tried) == (1, 1)
    assert math.isclose(found.figures[0].value, 0.0)
    assert behind_truth(said(), ()) == 0.0


@pytest.mark.parametrize(
    ("subject", "words"),
    [
        (case(said(BIAS), BAND), "not to be told from the truth: 4 nats"),
        (case(said(BIAS), LAG), "the truth was never fitted"),
        (case(said(), BAND), "the truth, fitted, is better by 56 nats"),
        (case(said(BIAS), kind="none"), "fits better than the truth by 60 nats"),
        (case(said(BIAS, gap=2.0), BAND), "gap of 2 x floor"),
        (case(said(BIAS), "valve_flow_saturation"), "largest command 0.5 of rated, below"),
        (case(said(BIAS, cannot_judge=frozenset([BAND])), BAND), "not to be judged: valve_dead"),
    ],
)
def test_reasons(subject: Scored, words: str) -> None:
    assert any(one.startswith(words) or words in one for one in reasons(subject))


def test_the_list_has_the_worst_first_and_nothing_that_is_right() -> None:
    cases = [case(said(), BAND), case(said(BIAS), BIAS), case(said(BIAS), BAND)]
    assert [one.outcome for one in wrong_cases(cases)] == ["wrong name", "missed"]
    assert wrong_cases(cases)[0].said == "effects: valve_null_bias"
