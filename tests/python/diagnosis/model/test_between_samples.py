# SPDX-License-Identifier: MIT
"""Logs of a controller that sends two commands for each one that is logged."""

from __future__ import annotations

from collections.abc import Mapping

import gap_cases as made
import numpy as np
import pytest

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.diagnosis.deciding import LEAST_SHARE
from ehsid.harness.diagnosis.model.between_samples import (
    LEAST_MOVE,
    NAME,
    unknown_command_power,
)
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.search.candidates import FittedCandidate, calibrate
from ehsid.harness.diagnosis.search.score import left, share_of_tolerance
from ehsid.harness.records import Record, make_record
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

DT_S = 0.02
Calibration = tuple[Case, FittedCandidate]


def logged(seed: int, *, every: int) -> Record:
    """A motion whose commands act for DT_S / every each; every one at a multiple of DT_S is kept.

    Its frequencies reach a tenth of those of the log.
    """
    rng = np.random.default_rng(seed)
    dt_s = DT_S / every
    command = multisine(round(20.0 / dt_s), dt_s, band_hz=(0.2, 5.0), rms=2.0, rng=rng)
    noise = draw_noise(made.RIG, command.size, rng)
    run = simulate(
        made.RIG, command, dt_s=dt_s, values=dict(made.OFF), substeps=40 // every, noise=noise
    ).record
    names = ("command_v", *made.PRESSURES)
    columns = {name: run.column(name)[::every] for name in names}
    assert run.time_s is not None
    return make_record({"time_s": run.time_s[::every], **columns})


def calibrated(every: int) -> Calibration:
    case = make_case(made.RIG, [logged(1, every=every)], [logged(2, every=every)])
    return case, calibrate(case)


@pytest.fixture(scope="module")
def twice() -> Calibration:
    return calibrated(2)


def move(case: Case, candidate: FittedCandidate) -> float:
    names = [parameter.name for parameter in case.parameters()]
    return float(candidate.x[names.index(NAME)])


def test_a_command_that_is_held_is_found_to_be_and_nothing_more_is_tolerated() -> None:
    case, candidate = calibrated(1)
    assert move(case, candidate) < LEAST_MOVE
    same = case.with_unknown_commands((), candidate.x)
    assert not any(same.unknown.values())
    # A perfect simulator leaves noise beside as much tolerance: ln(2) / 2 at the most.
    assert left(same, candidate) == left(case, candidate) < 0.35


def test_two_commands_a_sample_move_by_half_of_the_way(twice: Calibration) -> None:
    assert move(*twice) == pytest.approx(0.5, abs=0.15)


def test_unknown_commands_count_whole_or_not_at_all(twice: Calibration) -> None:
    """A controller sends no part of a command: a move of a fifth is one that the fit sees badly."""
    case, candidate = twice
    problem = case.problem()
    place = [parameter.name for parameter in problem.parameters].index(NAME)

    def power(share: float) -> Mapping[str, FloatArray]:
        x = candidate.x.copy()
        x[place] = share
        return unknown_command_power(problem, x)

    assert power(0.9 * LEAST_MOVE) == {}
    few, many = power(0.2), power(0.6)
    assert set(few) == set(many) == set(case.outputs)
    for name, powers in few.items():
        assert np.array_equal(powers, many[name]), name


def test_what_is_tolerated_is_no_less_than_what_unknown_commands_do(twice: Calibration) -> None:
    """Octave by octave, beside the errors of the true rig on the log of half of the commands.

    Commands of random signs are an upper bound: here they follow a smooth course. The decision
    takes the share of it that the best set shows to be enough.
    """
    case, candidate = twice
    wider = case.with_unknown_commands((), candidate.x)
    problem = case.problem(held_out=True)
    errors = problem.coefficients(candidate.x)
    compared = 0
    for name in case.outputs:
        found = problem.spectrum.powers(errors[name])
        noise = problem.likelihoods[name].tolerated
        unknown = wider.unknown[True][name]
        for power, tolerated, more in zip(found, noise, unknown, strict=True):
            if power > 4.0 * tolerated:  # clear of noise and of the share of the motion
                compared += 1
                assert 0.5 < more / power < 100.0, name
    assert compared >= 3
    whole = left(wider, candidate)
    assert whole < 0.5 * left(case, candidate)
    share = share_of_tolerance(wider, [candidate])
    assert LEAST_SHARE <= share < 0.8
    assert whole < left(wider, candidate, share=share) < 0.7
