# SPDX-License-Identifier: MIT
"""Probabilities that are meant and those that are not; errors of sizes and their intervals."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_checks import diagnosis, made_answers, write_check

from ehsid.harness.diagnosis.schema import Estimate
from ehsid.lab.blind.making import Answer
from ehsid.lab.scoring.figures import (
    EDGES,
    Claim,
    claims_of,
    effect_errors,
    reliability,
    rig_errors,
    risk_curve,
)
from ehsid.lab.scoring.findings import Findings, NamedEffect
from ehsid.lab.scoring.judging import ScoredCase, judge
from ehsid.lab.scoring.score import score_folder

CLAIMS = st.lists(st.builds(Claim, st.floats(0.0, 1.0), st.booleans()), min_size=1, max_size=80)


def test_probabilities_that_are_meant_lie_on_the_line() -> None:
    rng = np.random.default_rng(2)
    n = 20_000
    p = rng.uniform(0.2, 0.97, n)
    found = reliability([Claim(float(x), bool(rng.random() < x)) for x in p])
    for one in found.bins:
        # the interval of 90 % widened from 1.64 to 4 deviations
        half = 2.5 * (one.true.high - one.true.low) / 2.0
        assert abs(one.true.value - one.probability) < half
    # E|share - p| over bins of n_b: below the sum of w_b sqrt(p (1 - p) / n_b) < bins / (2 sqrt(n))
    assert found.expected_error < len(found.bins) / (2.0 * math.sqrt(n))
    assert found.brier == pytest.approx(np.mean(p * (1.0 - p)), abs=0.01)
    assert found.brier < found.brier_constant


def test_certain_and_wrong_is_the_worst() -> None:
    found = reliability([Claim(1.0, False)] * 4)
    assert (found.brier, found.expected_error) == (1.0, 1.0)


@given(st.lists(st.tuples(st.sampled_from(EDGES[:-1]), st.booleans()), min_size=1, max_size=80))
def test_brier_score_is_that_of_murphy(pairs: list[tuple[float, bool]]) -> None:
    """Reliability less resolution plus uncertainty (A. H. Murphy, J. Appl. Meteorol. 12(4), 1973).

    Exact where all probabilities of a bin are the same, as at its lower edge.
    """
    found = reliability([Claim(p, true) for p, true in pairs])
    rate = np.mean([true for _, true in pairs])
    terms = [
        one.true.n
        / len(pairs)
        * ((one.probability - one.true.value) ** 2 - (one.true.value - rate) ** 2)
        for one in found.bins
    ]
    assert found.brier == pytest.approx(sum(terms) + found.brier_constant, abs=1e-12)


@given(CLAIMS)
def test_every_claim_is_in_one_bin(claims: list[Claim]) -> None:
    found = reliability(claims)
    assert sum(one.true.n for one in found.bins) == found.claims == len(claims)
    assert 0.0 <= found.expected_error <= 1.0


def test_no_claims() -> None:
    found = reliability([])
    assert found.claims == 0
    assert math.isnan(found.brier)


@pytest.fixture(scope="module")
def score(tmp_path_factory: pytest.TempPathFactory):  # type: ignore[no-untyped-def]
    """Names with p: right in the surer half of the cases with a name."""
    answers = made_answers(60)
    named = [name for name, one in answers.items() if one["kind"] in ("one", "two")]
    sure = set(named[: len(named) // 2])

    def how(answer: dict, _: object) -> dict:
        name = next(n for n, one in answers.items() if one is answer)
        if name not in named:
            return diagnosis("no_gap")
        truth = dict(list(answer["effects"].items())[:1])
        if name in sure:
            return diagnosis("effects", truth, probability=0.9)
        other = "load_spring" if "valve" in next(iter(truth)) else "valve_lag"
        return diagnosis("effects", {other: {}}, probability=0.5)

    return score_folder(write_check(tmp_path_factory.mktemp("risk"), answers, how))


@pytest.mark.slow
def test_risk_over_coverage(score) -> None:  # type: ignore[no-untyped-def]
    sure, all_names = risk_curve(score.cases)
    names = sum(bool(case.findings.named) for case in score.cases)
    assert (sure.threshold, sure.risk.value) == (0.9, 0.0)
    assert sure.coverage == pytest.approx((names // 2) / 60)
    assert all_names.coverage == pytest.approx(names / 60)
    wrong = sum(case.judgement.wrong_name or False for case in score.cases)
    assert all_names.risk.value == pytest.approx(wrong / names)


def test_claims_are_true_by_the_same_rule_as_names(score) -> None:  # type: ignore[no-untyped-def]
    claims = [claim for case in score.cases for claim in claims_of(case)]
    assert {claim.true for claim in claims if claim.probability == 0.9} == {True}
    firsts = [case.judgement.effect_first for case in score.cases if case.findings.named]
    assert [claim.true for claim in claims] == firsts


STRIBECK = {"coulomb_n": 500.0, "static_n": 1000.0, "stribeck_velocity_m_s": 0.02}


def stribeck_case(kind: str = "one", truth: str = "stribeck_friction") -> ScoredCase:
    answer = Answer(
        kind,
        "plain",
        "ehs",
        "position",
        ("prbs",),
        {truth: STRIBECK},
        ("mechanics",),
        {"load.mass_kg": 100.0, "supply.pressure_pa": 1e7},
    )
    named = NamedEffect(
        "stribeck_friction",
        0.9,
        {
            "coulomb_n": Estimate(505.0, 490.0, 520.0),
            "static_n": Estimate(900.0, 880.0, 920.0),
            "stribeck_velocity_m_s": Estimate(math.nan, math.nan, math.nan),
        },
    )
    findings = Findings(
        "effects",
        (named,),
        calibration={
            "load.mass_kg": Estimate(102.0, 99.0, 105.0),
            "supply.pressure_pa": Estimate(1.1e7, 1.05e7, 1.15e7),
            "nuisance.presliding_m": Estimate(2e-5, 1e-5, 3e-5),
        },
    )
    return ScoredCase("a1", answer, findings, judge(answer, findings))


def test_sizes_by_parameter() -> None:
    first, second = effect_errors([stribeck_case()])
    assert (first.parameter, first.primary, first.inside) == ("coulomb_n", True, True)
    assert math.isclose(first.relative, 0.01)
    assert (second.parameter, second.primary, second.inside) == ("static_n", False, False)
    assert math.isclose(second.relative, 0.1)


def test_sizes_of_another_name_are_not_compared() -> None:
    assert effect_errors([stribeck_case(truth="coulomb_friction")]) == ()


def test_rig_values_have_a_truth_nuisances_have_none() -> None:
    mass, pressure = rig_errors([stribeck_case()])
    assert (mass.parameter, mass.inside) == ("load.mass_kg", True)
    assert (pressure.inside, round(pressure.relative, 6)) == (False, 0.1)


def test_values_of_a_machine_with_something_unknown_are_not_compared() -> None:
    assert rig_errors([stribeck_case("open", "second_load_mass")]) == ()


def test_a_size_of_nothing_has_no_relative_error() -> None:
    case = stribeck_case()
    answer = Answer(
        "one", "plain", "ehs", "position", ("prbs",), {"stribeck_friction": {"coulomb_n": 0.0}}, ()
    )
    (found,) = effect_errors([ScoredCase("a1", answer, case.findings, case.judgement)])
    assert math.isinf(found.relative)
