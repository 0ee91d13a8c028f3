# SPDX-License-Identifier: MIT
"""Simpler methods, read off the candidates of a diagnosis."""

from scored_cases import BAND, BIAS, CANDIDATES, LAG, N, candidate, case, findings
from statsmodels.tools.eval_measures import bic as bic_of

from ehsid.harness.diagnosis.schema import Candidate
from ehsid.lab.scoring.baselines import baselines, best_fit, largest_gain, lowest_bic, refit_only
from ehsid.lab.scoring.findings import Findings
from ehsid.lab.scoring.judging import judge


def ids(found: Findings | None) -> list[str]:
    assert found is not None
    return [one.id for one in found.named]


def test_best_fit_takes_the_lowest_cost_whatever_it_costs() -> None:
    assert ids(best_fit(case(findings(BIAS), BIAS))) == [BAND, LAG]


def test_bic_is_half_that_of_statsmodels() -> None:
    subject = case(findings(BIAS), BIAS)
    theirs = [bic_of(-one.fitted_cost, N, one.free) for one in CANDIDATES if one.fitted_cost]
    best = CANDIDATES[min(range(len(theirs)), key=theirs.__getitem__)]
    assert ids(lowest_bic({"a1": N})(subject)) == list(best.effects) == [BAND]


def test_bic_keeps_the_rig_alone_where_effects_gain_little() -> None:
    little = (candidate((), 0.0, 100.0, 1.0, 12), candidate((BAND,), 0.0, 98.0, 1.0, 13))
    found = lowest_bic({"a1": N})(case(findings(BAND, candidates=little), BAND))
    assert found is not None
    assert (found.verdict, found.named) == ("parameters", ())


def test_ways_without_what_they_need_say_nothing() -> None:
    bare = case(findings(BIAS, candidates=(Candidate((BIAS,), 0.0, 0.0),)), BIAS)
    assert best_fit(bare) is None
    assert lowest_bic({"a1": N})(bare) is None
    assert lowest_bic({"a1": None})(case(findings(BIAS), BIAS)) is None
    assert largest_gain(bare) is None


def test_largest_gain_is_counted_in_its_noise() -> None:
    subject = case(findings(BIAS, equations=(("mechanics", 3.0), ("valve", 8.0))), BIAS)
    found = largest_gain(subject)
    assert found is not None
    assert judge(subject.answer, found).subsystem_first


def test_refit_only_never_blames_an_effect() -> None:
    found = refit_only(case(findings(BAND), kind="none"))
    assert found is not None
    assert (found.verdict, found.named) == ("parameters", ())


def test_all_ways_stand_beside_each_other() -> None:
    cases = [case(findings(BIAS), BIAS), case(findings(BAND), kind="none")]
    table = {one.name: {f.words: f for f in one.figures} for one in baselines(cases, {"a1": N})}
    assert next(iter(table)) == "this diagnosis"
    assert table["this diagnosis"]["effect first"].value == 1.0
    assert table["best fit in sample"]["effect first"].value == 0.0
    assert table["best fit in sample"]["effect where there is none"].value == 1.0
    assert table["refit only"]["effect where there is none"].value == 0.0
    assert table["largest gain of an equation"]["subsystem first"].n == 0
