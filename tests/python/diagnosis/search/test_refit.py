# SPDX-License-Identifier: MIT
"""What may be the answer is fitted again, with what the search shows and with all data."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import gap_cases as made
import numpy as np
import pytest
from made_candidates import CASE, FLOOR, candidate, search_result

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.diagnosis import diagnose, diagnosis
from ehsid.harness.diagnosis.deciding import EVIDENCE
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.fit import Fit
from ehsid.harness.diagnosis.model.problem import Problem
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.search import refit
from ehsid.harness.diagnosis.search.candidates import (
    FittedCandidate,
    calibrate,
    decision_case,
    nominal_candidate,
    refine_finely,
)
from ehsid.harness.diagnosis.search.intervals import matters
from ehsid.harness.diagnosis.search.refit import (
    BEHIND,
    fitted_again,
    fitted_to_all,
    fitted_together,
    with_slower_spools,
)
from ehsid.harness.diagnosis.search.score import left, score_of
from ehsid.harness.diagnosis.search.search import SearchResult, search
from ehsid.harness.records import Record
from ehsid.harness.signals.excitation import multisine, triangle


def test_the_rig_and_the_likely_sets_are_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    near, far = candidate("sensor_lag", rms=2.0 * FLOOR), candidate("coulomb_friction", rms=1e-4)
    found = search_result(candidate(rms=100.0 * FLOOR), near, far)
    best = score_of(CASE, near)
    assert score_of(CASE, far) < best - BEHIND
    assert score_of(CASE, found.calibrated) < best - BEHIND
    asked = []

    def better(case: Case, effects: tuple[str, ...], x: object) -> FittedCandidate:
        assert case is CASE
        start = found.calibrated if not effects else near
        assert x is start.x
        asked.append(effects)
        # Worse on held-out data than what is not fitted again, so that the order changes.
        return replace(start, cost=start.cost - 1.0, held_out_cost=far.held_out_cost + 1.0)

    monkeypatch.setattr(refit, "refine_finely", better)
    again = fitted_again(CASE, found)
    assert sorted(asked) == [(), ("sensor_lag",)]
    assert again.calibrated.cost == found.calibrated.cost - 1.0
    assert again.refined[0] is far
    assert again.refined[1].cost == near.cost - 1.0
    assert again.nominal is found.nominal
    assert again.screened is found.screened


def test_limits_of_the_speed_are_looked_for_beside_likely_sets(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    near, far = candidate("sensor_lag", rms=2.0 * FLOOR), candidate("coulomb_friction", rms=1e-4)
    found = search_result(candidate(rms=3.0 * FLOOR), near, far)
    limited = replace(near, cost=near.cost - 9.0)

    def slower(_case: Case, each: FittedCandidate) -> FittedCandidate:
        assert each is not far
        return limited if each is near else each

    monkeypatch.setattr(refit, "again_with_slower_spool", slower)
    again = with_slower_spools(CASE, found)
    assert again.calibrated is found.calibrated
    assert set(map(id, again.refined)) == {id(limited), id(far)}


# Five times as much friction at rest as at speed: no servo has more than three times as much.
STRIBECK = ("stribeck_friction",)
UNUSUAL = {
    "effects.stribeck_friction.coulomb_n": 400.0,
    "effects.stribeck_friction.static_n": 2000.0,
    "effects.stribeck_friction.stribeck_velocity_m_s": 0.01,
}


@pytest.mark.slow
def test_no_fit_of_a_likely_set_ends_beyond_usual_sizes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The free fit finds the true sizes, which are not usual; no answer may have them."""
    case = made.case_of({**made.OFF, **UNUSUAL})
    problem = case.problem(STRIBECK)
    x = problem.centre()
    for place, each in enumerate(problem.parameters):
        x[place] = each.place(UNUSUAL.get(each.name, each.value(x[place])))
    free = refine_finely(case, STRIBECK, x)
    assert not matters(*STRIBECK, free.values, case.rig)
    calibrated = calibrate(case)
    found = SearchResult(case, nominal_candidate(case), calibrated, (free,), ())
    monkeypatch.setattr(refit, "_likely", lambda _case, all_of: [calibrated, *all_of.refined])
    (again,), (divided,) = (
        found.refined
        for found in (fitted_again(case, found), fitted_together(case, copy(case), found))
    )
    _, of_all = fitted_to_all(case, found)
    for fitted in (again, divided, of_all.freely, of_all.held):
        assert fitted.effects == STRIBECK
        assert matters(*STRIBECK, fitted.values, case.rig)
        # It still explains more than no friction.
        assert left(decision_case(case), fitted) < left(decision_case(case), calibrated)


SOFT = {"fluid.bulk_modulus_pa": 0.8e9}
# A valve that is slower than the simulator's: many values can follow it a little.
SLOW_VALVE = {"effects.valve_lag.bandwidth_hz": 60.0, "effects.valve_lag.damping": 0.8}


def measured(kind: str, values: Mapping[str, float] = SOFT) -> Record:
    """A record that shows the stiffness of the oil, or one that does not."""
    rng = np.random.default_rng(len(kind))
    samples = round(4.0 / made.DT_S)
    command = (
        multisine(samples, made.DT_S, band_hz=(0.5, 60.0), rms=2.0, rng=rng)
        if kind == "fast"
        else triangle(samples, made.DT_S, amplitude=0.8, period_s=1.0)
    )
    return made.measured(made.RIG, command, rng, values)


@pytest.mark.slow
def test_what_only_held_out_records_excite_is_no_fault_of_a_set() -> None:
    case = make_case(made.RIG, [measured("slow")], [measured("fast")])
    calibrated = calibrate(case)
    found = SearchResult(case, nominal_candidate(case), calibrated, (), ())
    (both,) = fitted_to_all(case, found)
    assert both.effects == ()
    together, fine = both.freely, decision_case(case)
    # Only the oil spring tells the modulus, to a few per cent beside the volumes.
    assert together.values["fluid.bulk_modulus_pa"] == pytest.approx(0.8e9, rel=0.05)
    assert left(fine, together) < 0.5 * left(fine, calibrated)
    assert left(fine, together, "fitted") < left(fine, calibrated, "fitted") + 0.05
    # The costs are those of the two parts, at the values of all.
    assert together.cost == pytest.approx(fine.problem().cost(together.x), abs=1e-6)
    held_out = fine.problem(held_out=True)
    own = held_out.fit_cost(held_out.coefficients(together.x))
    assert together.held_out_cost == pytest.approx(own, abs=1e-6)


@pytest.mark.slow
def test_values_are_held_as_their_priors_and_the_evidence_say() -> None:
    """EVIDENCE left(x) + prior(x) is least: no step of a value makes it clearly smaller."""
    records = [measured(kind, SLOW_VALVE) for kind in ("slow", "fast")]
    case = make_case(made.RIG, records[:1], records[1:])
    found = SearchResult(case, nominal_candidate(case), calibrate(case), (), ())
    (both,) = fitted_to_all(case, found)
    together = decision_case(case).together()
    problem, parameters = together.problem(), together.parameters(())
    independent = sum(float(one.counts.sum()) for one in problem.likelihoods.values())

    def price(x: np.ndarray) -> float:
        """Up to a constant."""
        away = [(value - one.centre) / one.sigma for value, one in zip(x, parameters, strict=True)]
        errors = problem.fit_cost(problem.coefficients(x)) / independent
        return EVIDENCE * errors + 0.5 * float(np.sum(np.square(away)))

    least = price(both.held.x)
    # What hardly makes the errors smaller moved values far.
    assert least < price(both.freely.x) - 3.0
    for place, one in enumerate(parameters):
        for sign in (1.0, -1.0):
            x = both.held.x.copy()
            x[place] += sign * 0.5 * one.sigma
            if one.low <= x[place] <= one.high:
                assert least < price(x), one.name


@pytest.mark.slow
def test_a_fit_that_stopped_early_gives_way_to_a_better_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case = made.case_of(made.OFF)
    calibrated = calibrate(case)
    found = SearchResult(case, nominal_candidate(case), calibrated, (), ())
    stopped = calibrated.x.copy()
    place = [each.name for each in case.parameters()].index("fluid.bulk_modulus_pa")
    stopped[place] += 0.3
    fit = refit.fit

    def at_first_none(problem: Problem, x: FloatArray, *, iterations: int) -> Fit:
        if iterations == refit.ITERATIONS_TOGETHER:
            return Fit(stopped, problem.cost(stopped), 0, False)
        return fit(problem, x, iterations=iterations)

    monkeypatch.setattr(refit, "fit", at_first_none)
    (both,) = fitted_to_all(case, found)
    fine = decision_case(case)
    assert both.freely is both.held
    assert both.held.x[place] < stopped[place] - 0.1
    # Else the fit that the data move as far as they like is the one that leaves less.
    monkeypatch.undo()
    (whole,) = fitted_to_all(case, found)
    assert left(fine, whole.freely) < left(fine, whole.held)


@pytest.mark.slow
def test_the_diagnosis_decides_by_what_all_data_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    # Else what is left on the held-out record would have all fitted together.
    monkeypatch.setattr(diagnosis, "_shown_by_held_out", lambda _: None)
    options = DiagnosisOptions(exclude=made.all_but("valve_dead_band"))
    records = [measured("slow")], made.RIG, [measured("fast")]
    told = diagnose(records[0], records[1], validate=records[2], options=options)
    monkeypatch.setattr(diagnosis, "fitted_to_all", lambda *_: ())
    apart = diagnose(records[0], records[1], validate=records[2], options=options)
    (left_by_all,), (left_apart,) = (
        [each.left for each in found.candidates if not each.effects] for found in (told, apart)
    )
    assert left_by_all is not None
    assert left_apart is not None
    assert left_by_all < 0.5 * left_apart
    assert told.outside_probability < 0.5 * apart.outside_probability
    # The gap that is told is that of data that no value has seen.
    assert told.how_far == apart.how_far


@pytest.mark.slow
def test_values_that_only_held_out_records_show_are_told_without_another_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The stiffness of the oil is that of the fast record, which alone shows it."""
    options = DiagnosisOptions(exclude=made.all_but("valve_dead_band"))
    searched = []

    def counted(*arguments: object) -> SearchResult:
        searched.append(arguments)
        return search(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(diagnosis, "search", counted)
    told = diagnose([measured("slow")], made.RIG, validate=[measured("fast")], options=options)
    assert len(searched) == 1
    assert [remark.what for remark in told.remarks][-1] == diagnosis.VALUES_OF_ALL
    assert told.calibration["fluid.bulk_modulus_pa"].found.value == pytest.approx(0.8e9, rel=0.05)
    assert told.how_far is not None
    assert told.how_far.calibrated < 0.1 * told.how_far.nominal


def test_likely_sets_are_fitted_to_another_division_of_the_records(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    near, far = candidate("sensor_lag", rms=2.0 * FLOOR), candidate("coulomb_friction", rms=1e-4)
    found = search_result(candidate(rms=3.0 * FLOOR), near, far)
    joint = copy(CASE)
    monkeypatch.setattr(
        joint, "problem", lambda effects: SimpleNamespace(cost=lambda x: (effects, x))
    )
    nominal = candidate(rms=1.0)
    costs = {(): 5.0, ("sensor_lag",): 4.0}

    def fitted(case: Case, effects: tuple[str, ...], x: object) -> FittedCandidate:
        assert case is joint
        start = found.calibrated if not effects else near
        assert x is start.x
        return replace(start, cost=costs[effects])

    def as_it_is(case: Case, effects: tuple[str, ...], fit: Fit) -> FittedCandidate:
        assert case is joint
        assert (effects, fit.x, fit.cost) == (far.effects, far.x, (far.effects, far.x))
        return replace(far, held_out_cost=7.0)

    monkeypatch.setattr(refit, "refine_finely", fitted)
    monkeypatch.setattr(refit, "evaluate", as_it_is)
    monkeypatch.setattr(refit, "nominal_candidate", lambda case: nominal if case is joint else None)
    again = fitted_together(CASE, joint, found)
    assert again.nominal is nominal
    assert again.calibrated.cost == 5.0
    assert [(each.effects, each.cost) for each in again.refined] == [(("sensor_lag",), 4.0)]
    assert [(each.effects, each.held_out_cost) for each in again.screened] == [(far.effects, 7.0)]


def test_of_blocks_all_are_fitted() -> None:
    case = make_case(made.RIG, [measured("fast")])
    assert case.blocks
    together = case.together()
    counts = [case.problem(held_out=part).records[0].used.sum() for part in (False, True)]
    whole = together.problem().records[0].used.sum()
    assert whole >= sum(counts) > max(counts)
    assert together.records == case.records


def test_unlogged_commands_count_as_in_both_parts() -> None:
    powers = {part: {"position_m": np.full(10, size)} for part, size in ((False, 1.0), (True, 3.0))}
    case = make_case(made.RIG, [measured("slow")], [measured("fast")])
    assert case.together().unknown == {False: {}}
    together = replace(case, unknown=powers).together()
    np.testing.assert_array_equal(together.unknown[False]["position_m"], np.full(10, 2.0))


def test_a_users_simulator_is_not_fitted_to_all() -> None:
    class Engine(type(CASE)):  # type: ignore[misc]
        engine = object()

    assert fitted_to_all(Engine(), search_result(candidate(rms=1e-4))) == ()
