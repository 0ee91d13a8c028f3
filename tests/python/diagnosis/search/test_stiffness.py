# SPDX-License-Identifier: MIT
"""The stiffness of the oil beside effects, where the sampling is too slow for its oil spring."""

from __future__ import annotations

from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest

from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.fit import BEHIND_NATS
from ehsid.harness.diagnosis.search import candidates
from ehsid.harness.diagnosis.search import search as searching
from ehsid.harness.diagnosis.search.candidates import (
    FittedCandidate,
    again_with_other_stiffness,
    calibrate,
    nominal_candidate,
    refine,
)
from ehsid.harness.diagnosis.search.stiffness import STARTS, STIFFNESS, stiffness_starts
from ehsid.harness.records import Record, make_record
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

# The oil spring of the bench is at some 30 Hz: above half the sampling rate.
SLOW_S = 0.05
TRUE = {**made.OFF, STIFFNESS: 1.6e9, "effects.load_force.force_n": -3000.0}
FORCE = ("load_force",)
# Neighbouring trials differ by 4 % in the frequency of the oil spring: 8 % in the stiffness.
STEP = 0.08


def measured(seed: int, dt_s: float) -> Record:
    rng = np.random.default_rng(seed)
    command = multisine(round(30.0 / dt_s), dt_s, band_hz=(0.3, 4.0), rms=3.0, rng=rng)
    noise = draw_noise(made.RIG, command.size, rng)
    substeps = round(dt_s / 2e-4)
    run = simulate(made.RIG, command, dt_s=dt_s, values=TRUE, substeps=substeps, noise=noise)
    columns = {name: run.record.column(name) for name in ("command_v", "position_m")}
    return make_record({"time_s": run.record.time_s, **columns})


def case_of(dt_s: float) -> Case:
    return make_case(made.RIG, [measured(1, dt_s)], [measured(2, dt_s)])


@pytest.fixture(scope="module")
def slow() -> Case:
    return case_of(SLOW_S)


def x_at(case: Case, stiffness_pa: float) -> np.ndarray:
    """The true rig and force, but for the stiffness."""
    parameters = case.parameters(FORCE)
    values = {**TRUE, STIFFNESS: stiffness_pa}
    centre = case.problem(FORCE).centre()
    return np.array(
        [
            each.place(values[each.name]) if each.name in values else x
            for each, x in zip(parameters, centre, strict=True)
        ]
    )


def off(stiffness_pa: float) -> float:
    """Distance from the true stiffness, ln."""
    return abs(float(np.log(stiffness_pa / TRUE[STIFFNESS])))


def best_cost(case: Case) -> float:
    """Cost of the fit from the true values."""
    return refine(case, FORCE, x_at(case, TRUE[STIFFNESS])).cost


def test_starts_are_the_lowest_minima_over_the_stiffness(slow: Case) -> None:
    problem = slow.problem(FORCE)
    about = x_at(slow, 0.7e9)
    starts = stiffness_starts(problem, about)
    assert 1 <= len(starts) <= STARTS
    place = [each.name for each in problem.parameters].index(STIFFNESS)
    costs = [problem.cost(start) for start in starts]
    assert costs == sorted(costs)
    assert costs[0] <= problem.cost(about)
    for start in starts:
        # Nothing else is tried.
        np.testing.assert_array_equal(np.delete(start, place), np.delete(about, place))
    # The true one is among them, to a step of the trials.
    found = [problem.parameters[place].value(float(start[place])) for start in starts]
    assert min(map(off, found)) < STEP


@pytest.mark.slow
@pytest.mark.parametrize("stiffness_pa", [0.5e9, 0.7e9, 2.2e9])
def test_a_fit_that_settled_on_a_wrong_stiffness_leaves_it(slow: Case, stiffness_pa: float) -> None:
    settled = refine(slow, FORCE, x_at(slow, stiffness_pa))
    assert off(settled.values[STIFFNESS]) > STEP
    found = again_with_other_stiffness(slow, settled)
    assert found.effects == FORCE
    assert off(found.values[STIFFNESS]) < STEP
    assert found.cost < best_cost(slow) + BEHIND_NATS < settled.cost
    # From there, no other one is better.
    assert again_with_other_stiffness(slow, found) is found


@pytest.mark.slow
def test_the_values_of_the_rig_leave_a_wrong_stiffness_too(
    slow: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the calibration does: of its own starts, all may settle beside the best one."""
    asked = []

    def again(case: Case, candidate: FittedCandidate) -> FittedCandidate:
        asked.append(candidate.effects)
        return candidate

    monkeypatch.setattr(candidates, "again_with_other_stiffness", again)
    calibrate(slow)
    assert asked == [()]


@pytest.mark.slow
def test_a_search_tries_other_stiffnesses_beside_each_effect(
    slow: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def again(case: Case, candidate: FittedCandidate) -> FittedCandidate:
        asked.append(candidate.effects)
        return again_with_other_stiffness(case, candidate)

    monkeypatch.setattr(searching, "again_with_other_stiffness", again)
    found = searching.search(slow, made.all_but(*FORCE))
    assert asked == [FORCE]
    (best,) = (each for each in found.refined if each.effects == FORCE)
    assert off(best.values[STIFFNESS]) < STEP
    assert best.cost < best_cost(slow) + BEHIND_NATS


def test_where_the_sampling_follows_the_oil_spring_nothing_is_tried() -> None:
    case = replace(case_of(5e-3), substeps=4)
    candidate = nominal_candidate(case)
    assert again_with_other_stiffness(case, candidate) is candidate
