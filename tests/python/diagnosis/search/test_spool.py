# SPDX-License-Identifier: MIT
"""A limit of the spool's speed is found, although no fit is led to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest

from ehsid.harness.diagnosis import diagnosis
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.fit import Fit, fit
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.search import candidates, search
from ehsid.harness.diagnosis.search.candidates import (
    FittedCandidate,
    again_with_slower_spool,
    calibrate,
    decision_case,
    refine,
)
from ehsid.harness.diagnosis.search.spool import SLEW, UNLIMITED_1_S, with_slower_spool
from ehsid.harness.records import Record

BIAS = "effects.valve_null_bias.offset"
# A step of 8 V at 120 1/s takes 7 ms.
LIMITED = {SLEW: 120.0}


def measured(values: Mapping[str, float], seed: int, largest_v: float = 8.0) -> Record:
    """Steps of the command, one in 0.1 s, each up to twice the largest value."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(-largest_v, largest_v, 40), round(0.1 / made.DT_S))
    return made.measured(made.RIG, levels, rng, values)


def case_of(values: Mapping[str, float]) -> Case:
    return make_case(made.RIG, [measured(values, 8)], [measured(values, 9)])


def unlimited(case: Case) -> Fit:
    """The fit from the values of the rig file."""
    problem = case.problem()
    return fit(problem, problem.centre(), iterations=12)


def slew_of(case: Case, fitted: Fit) -> float:
    place = [parameter.name for parameter in case.parameters()].index(SLEW)
    return case.parameters()[place].value(float(fitted.x[place]))


@pytest.mark.slow
@pytest.mark.parametrize("limit", [95.0, 120.0, 210.0])
def test_a_limit_is_identified_though_it_has_no_slope(limit: float) -> None:
    case = case_of({SLEW: limit})
    assert slew_of(case, unlimited(case)) > UNLIMITED_1_S
    assert calibrate(case).values[SLEW] == pytest.approx(limit, rel=0.1)


@pytest.mark.parametrize("largest_v", [0.2, 8.0])
def test_without_a_limit_the_fit_is_as_it_was(largest_v: float) -> None:
    # Small commands reach none of the limits, and only the prior speaks against them.
    records = [measured({}, seed, largest_v) for seed in (8, 9)]
    case = make_case(made.RIG, records[:1], records[1:])
    best = unlimited(case)
    assert with_slower_spool(case.problem(), case.problem(held_out=True), best, 6) is best


def test_what_stopped_fits_differ_by_is_no_limit() -> None:
    records = [measured({}, seed, 0.2) for seed in (8, 9)]
    case = make_case(made.RIG, records[:1], records[1:])
    best = unlimited(case)
    stopped = replace(best, cost=best.cost + 0.9)
    assert with_slower_spool(case.problem(), case.problem(held_out=True), stopped, 6) is stopped


def test_a_limit_between_those_that_are_tried_is_found_exactly() -> None:
    case = case_of({SLEW: 203.0})
    problem, held_out = case.problem(), case.problem(held_out=True)
    found = with_slower_spool(problem, held_out, unlimited(case), 12)
    assert slew_of(case, found) == pytest.approx(203.0, rel=0.04)


def test_a_limit_that_only_held_out_commands_reach_is_found() -> None:
    # Steps of 0.4 V at 120 1/s take less than a millisecond.
    case = make_case(made.RIG, [measured(LIMITED, 8, largest_v=0.2)], [measured(LIMITED, 9)])
    calibrated = refine(case, (), unlimited(case).x)
    assert calibrated.values[SLEW] > UNLIMITED_1_S
    found = again_with_slower_spool(case, calibrated)
    # No fit moves it: it is the one of those that are tried.
    assert found.values[SLEW] == pytest.approx(120.0, rel=1e-9)
    assert found.held_out_cost < calibrated.held_out_cost - 50.0


def test_a_plant_without_a_limit_is_not_tried() -> None:
    case = case_of({})
    problem = case.problem()
    others = [parameter for parameter in problem.parameters if parameter.name != SLEW]
    problem.parameters = tuple(others)
    best = Fit(problem.centre(), 0.0, 0, True)
    assert with_slower_spool(problem, problem, best, 6) is best


def beside_an_effect() -> tuple[Case, FittedCandidate]:
    """A null bias beside the limit, and the fit of the bias from the values of the rig file."""
    case = case_of({**LIMITED, BIAS: 0.02})
    return case, refine(case, ("valve_null_bias",), np.append(case.problem().centre(), 0.02))


@pytest.mark.slow
def test_a_limit_beside_an_effect_is_found_and_the_effect_stays() -> None:
    case, candidate = beside_an_effect()
    assert candidate.values[SLEW] > UNLIMITED_1_S
    found = again_with_slower_spool(case, candidate)
    assert found.values[SLEW] == pytest.approx(120.0, rel=0.1)
    assert found.values[BIAS] == pytest.approx(0.02, rel=0.05)
    assert found.effects == candidate.effects
    # Its costs are those of the decision.
    fine = decision_case(case)
    assert found.cost == pytest.approx(fine.problem(found.effects).cost(found.x), rel=1e-9)
    assert found.cost + found.held_out_cost < candidate.cost + candidate.held_out_cost - 1.0


def test_what_is_no_better_in_the_end_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    case, candidate = beside_an_effect()
    problem = case.problem(candidate.effects)
    worse = Fit(problem.centre(), 0.0, 1, True)
    monkeypatch.setattr(candidates, "with_slower_spool", lambda *_: worse)
    monkeypatch.setattr(candidates, "fit", lambda _problem, x, **_: Fit(x, 1e9, 1, True))
    assert again_with_slower_spool(case, candidate) is candidate


def test_a_limit_that_is_known_is_not_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    case, candidate = beside_an_effect()
    monkeypatch.delattr(candidates, "with_slower_spool")
    limited = replace(candidate, values={**candidate.values, SLEW: 0.9 * UNLIMITED_1_S})
    assert again_with_slower_spool(case, limited) is limited


@pytest.mark.slow
def test_limits_are_looked_for_beside_the_best_effects_and_before_the_decision(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case = case_of({**LIMITED, BIAS: 0.02})
    others = made.all_but("valve_null_bias", "valve_dead_band")
    # The calibration does not find it here.
    monkeypatch.setattr(search, "calibrate", lambda each: refine(each, (), each.problem().centre()))
    found = search.search(case, others)
    (bias,) = (each for each in found.refined if each.effects == ("valve_null_bias",))
    assert bias.values[SLEW] == pytest.approx(120.0, rel=0.1)
    monkeypatch.setattr(search, "again_with_slower_spool", lambda _, each: each)
    without = search.search(case, others)
    assert all(each.values[SLEW] > UNLIMITED_1_S for each in without.refined)
    monkeypatch.undo()
    # What the search did not find is found before the decision.
    monkeypatch.setattr(diagnosis, "search", lambda *_: without)
    options = DiagnosisOptions(exclude=others)
    told = diagnosis.diagnose(case.training, made.RIG, validate=case.held_out, options=options)
    assert told.calibration[SLEW].found.value == pytest.approx(120.0, rel=0.1)
    assert [each.id for each in told.effects] == ["valve_null_bias"]
