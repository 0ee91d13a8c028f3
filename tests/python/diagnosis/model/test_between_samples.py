# SPDX-License-Identifier: MIT
"""Logs of a controller that sends two commands for each one that is logged."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.diagnosis.deciding import EFFECT, EVIDENCE, LEAST_SHARE
from ehsid.harness.diagnosis.model import case as case_module
from ehsid.harness.diagnosis.model.between_samples import (
    LEAST_MOVE,
    mean_move_of,
    unknown_command_power,
    unknown_commands,
)
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.comparison import compare
from ehsid.harness.diagnosis.model.problem import Problem
from ehsid.harness.diagnosis.model.unlogged import BETWEEN
from ehsid.harness.diagnosis.search import refit
from ehsid.harness.diagnosis.search.candidates import FittedCandidate, calibrate, refine
from ehsid.harness.diagnosis.search.score import left, share_of_tolerance
from ehsid.harness.diagnosis.search.search import SearchResult
from ehsid.harness.records import Record, make_record
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

DT_S = 0.02
Calibration = tuple[Case, FittedCandidate]


def logged(seed: int, *, every: int, values: Mapping[str, float] | None = None) -> Record:
    """A motion whose commands act for DT_S / every each; every one at a multiple of DT_S is kept.

    Its frequencies reach a tenth of those of the log.
    """
    rng = np.random.default_rng(seed)
    dt_s = DT_S / every
    command = multisine(round(20.0 / dt_s), dt_s, band_hz=(0.2, 5.0), rms=2.0, rng=rng)
    noise = draw_noise(made.RIG, command.size, rng)
    run = simulate(
        made.RIG,
        command,
        dt_s=dt_s,
        values={**made.OFF, **(values or {})},
        substeps=40 // every,
        noise=noise,
    ).record
    names = ("command_v", *made.PRESSURES)
    columns = {name: run.column(name)[::every] for name in names}
    assert run.time_s is not None
    return make_record({"time_s": run.time_s[::every], **columns})


def calibrated(every: int) -> Calibration:
    case = make_case(made.RIG, [logged(1, every=every)], [logged(2, every=every)])
    return case, calibrate(case)


def power_of(problem: Problem, x: FloatArray) -> Mapping[str, FloatArray]:
    """Power of unknown commands, two for each sample."""
    return unknown_command_power(problem, x, 0.5)


@pytest.fixture(scope="module")
def twice() -> Calibration:
    return calibrated(2)


def move(case: Case, candidate: FittedCandidate) -> float:
    names = [parameter.name for parameter in case.parameters()]
    return float(candidate.x[names.index(BETWEEN)])


def test_a_command_that_is_held_is_found_to_be_and_nothing_more_is_tolerated() -> None:
    case, candidate = calibrated(1)
    assert move(case, candidate) < LEAST_MOVE
    same = case.with_unlogged_commands((), candidate.x)
    assert same is case
    # A perfect simulator leaves noise beside as much tolerance: ln(2) / 2 at the most.
    assert left(same, candidate) == left(case, candidate) < 0.35


def test_two_commands_a_sample_move_by_half_of_the_way(twice: Calibration) -> None:
    assert move(*twice) == pytest.approx(0.5, abs=0.15)


def test_unknown_commands_count_whole_or_not_at_all(twice: Calibration) -> None:
    """A controller sends no part of a command: a move of a fifth is one that the fit sees badly."""
    case, candidate = twice
    parameters = case.parameters()
    place = [parameter.name for parameter in parameters].index(BETWEEN)

    def counts(share: float) -> float | None:
        x = candidate.x.copy()
        x[place] = share
        return mean_move_of(parameters, x)

    assert counts(0.9 * LEAST_MOVE) is None
    assert counts(0.2) == counts(0.6) == 0.5
    assert counts(0.8) == 0.8  # as many commands as five for each sample


def test_errors_that_unlogged_commands_cause_count_for_little(twice: Calibration) -> None:
    """The true rig is as good as perfect then, and the move of the mean course is held."""
    case, candidate = twice
    whitened = case.with_unlogged_commands((), candidate.x)
    assert set(whitened.unlogged) == set(case.records)
    again = calibrate(whitened)
    assert move(whitened, again) == 0.5
    assert left(whitened, again) < 0.25 < 0.5 * left(case, candidate)
    # What stays is tolerated, and the decision takes the share that the best set needs.
    share = share_of_tolerance(whitened, [again])
    assert LEAST_SHARE <= share <= 1.0
    plain = whitened.as_logged()
    assert not plain.unlogged
    assert not plain.unknown
    assert left(plain, candidate) == left(case, candidate)


def test_friction_shows_more_where_unlogged_commands_are_unknown_inputs() -> None:
    """One pressure against the other tells a friction, which no command can cause.

    Power that is tolerated in each octave hides a part of it: its gain is 0.15, ln, and here 0.26.
    """
    force_n = 200.0
    rubbing = {"effects.coulomb_friction.force_n": force_n}
    records = [logged(seed, every=2, values=rubbing) for seed in (3, 4)]
    case = make_case(made.RIG, records[:1], records[1:])
    x = calibrate(case).x
    whitened = case.with_unlogged_commands((), x)
    powers = {part: power_of(case.problem(held_out=part), x) for part in (False, True)}

    def gain(of: Case) -> tuple[float, float]:
        without = calibrate(of)
        fit = refine(of, ("coulomb_friction",), np.append(without.x, math.log(force_n)))
        found_n = fit.values["effects.coulomb_friction.force_n"]
        return left(of, without) - left(of, fit), abs(found_n - force_n)

    (told, error), (tolerated, larger) = gain(whitened), gain(replace(case, unknown=powers))
    assert told > 1.4 * tolerated > 0.1
    assert error < min(0.1 * force_n, larger)


def test_in_fast_logs_all_that_unlogged_commands_do_is_tolerated(
    twice: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    case, candidate = twice
    monkeypatch.setattr(case_module, "LONGEST", 24)  # a window has 25 samples
    tolerating = case.with_unlogged_commands((), candidate.x)
    assert not tolerating.unlogged
    assert set(tolerating.unknown) == {False, True}
    for part, of_part in tolerating.unknown.items():
        power = power_of(case.problem(held_out=part), candidate.x)
        for name in case.outputs:
            np.testing.assert_array_equal(of_part[name], power[name])


def alone(case: Case, candidate: FittedCandidate) -> SearchResult:
    """The result of a search that tried no effects."""
    return SearchResult(case, candidate, candidate, (), ())


def test_the_likelihood_tells_of_commands_that_a_fit_does_not_see(twice: Calibration) -> None:
    case, _ = twice
    blind = calibrate(replace(case, held={BETWEEN: 0.0}))
    assert move(case, blind) == 0.0
    assert left(case, blind) > refit.EXPLAINED
    anew = refit.contradicted(alone(case, blind))
    assert anew is not None
    assert set(anew.unlogged) == set(case.records)


def test_commands_that_are_held_are_held_whatever_the_search_began_with(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case, candidate = calibrated(1)
    monkeypatch.setattr(refit, "EXPLAINED", 0.0)
    assert refit.contradicted(alone(case, candidate)) is None
    wrong = case.with_unlogged_commands((), candidate.x, move=0.5)
    assert wrong.unlogged
    anew = refit.contradicted(alone(wrong, calibrate(wrong)))
    assert anew is not None
    assert not anew.unlogged
    assert move(anew, calibrate(anew)) == 0.0
    assert anew.with_unlogged_commands((), calibrate(anew).x) is anew


DELAY = "transport_delay"


def delayed_from(case: Case, delay_s: float) -> FittedCandidate:
    """A fit of a delay that starts at a size."""
    x = case.problem((DELAY,)).centre()
    x[-1] = case.parameters((DELAY,))[-1].place(delay_s)
    return refine(case, (DELAY,), x)


@pytest.mark.parametrize("begun", ["moving", "as logged"])
def test_a_delay_that_makes_up_for_a_command_that_wrongly_moves_is_seen_through(
    monkeypatch: pytest.MonkeyPatch, begun: str
) -> None:
    """Two commands a sample act earlier by a quarter of a sample, on average, than one does.

    A fit that may choose the move can stay where it began, as on a machine with a saturated valve.
    """
    monkeypatch.setattr(refit, "fitted_move", lambda *_: 0.5)
    case, _ = calibrated(1)
    wrong = case.with_unlogged_commands((), case.problem().centre(), move=0.5)
    delayed = delayed_from(wrong, 0.2 * DT_S)
    # The speed of the spool can make up for a part of it.
    assert delayed.values[f"effects.{DELAY}.delay_s"] == pytest.approx(0.25 * DT_S, rel=0.2)
    sound = calibrate(wrong)
    # So the delay would be named.
    assert EVIDENCE * (left(wrong, sound) - left(wrong, delayed)) > EFFECT
    searched = wrong if begun == "moving" else case
    anew = refit.contradicted(SearchResult(searched, sound, sound, (delayed,), ()))
    assert anew is not None
    assert not anew.unlogged
    assert left(anew, calibrate(anew)) < 0.35  # as of a command that is held, see above


def test_a_true_delay_does_not_pass_for_a_command_that_is_held() -> None:
    """It is half a sample long. A quarter would pass, because the commands are smooth here."""
    values = {f"effects.{DELAY}.delay_s": 0.5 * DT_S}
    records = [logged(seed, every=2, values=values) for seed in (1, 2)]
    case = make_case(made.RIG, records[:1], records[1:])
    moving = case.with_unlogged_commands((), case.problem().centre(), move=0.5)
    delayed = delayed_from(moving, 0.4 * DT_S)
    sound = calibrate(moving)
    found = SearchResult(moving, sound, sound, (delayed,), ())
    assert refit.contradicted(found) is None


@pytest.mark.slow
@pytest.mark.parametrize("fitted", ["held", "moving"])
def test_each_record_tells_whether_its_command_is_held(fitted: str) -> None:
    """Such as a binary sequence that changes at samples only, and a sum of sines."""
    by_kind = {"held": logged(1, every=1), "moving": logged(2, every=2)}
    held_out = "moving" if fitted == "held" else "held"
    case = make_case(made.RIG, [by_kind[fitted]], [by_kind[held_out]])
    candidate = calibrate(case)
    # As a search begins: the fitted record tells of both.
    begun = case.with_unlogged_commands((), candidate.x)
    assert bool(begun.unlogged) == (fitted == "moving")
    anew = refit.contradicted(alone(begun, calibrate(begun)))
    assert anew is not None
    assert {record: each.moves for record, each in anew.unlogged.items()} == {
        by_kind["held"]: False,
        by_kind["moving"]: True,
    }
    again = calibrate(anew)
    assert left(anew, again) < 0.25 < 0.5 * left(begun, calibrate(begun))
    # Of the record whose command is held, all errors count, and no others are tolerated.
    assert anew.unlogged[by_kind["held"]].widening[0] == 0.0
    assert not anew.unknown[fitted == "moving"]
    # It is the same where what such commands can do is asked again.
    asked = anew.with_unlogged_commands((), again.x)
    assert [each.moves for each in asked.unlogged.values()] == [
        each.moves for each in anew.unlogged.values()
    ]
    assert refit.contradicted(alone(anew, again)) is None


@pytest.mark.parametrize("kind", ["smooth", "random walk", "random"])
def test_deviations_are_those_of_the_commands_that_were_left_out(kind: str) -> None:
    """Against commands of twice the rate, of which every second one is logged."""
    rng = np.random.default_rng(6)
    count = 8000
    white = rng.standard_normal(count)
    sent = {
        "smooth": multisine(count, 0.5 * DT_S, band_hz=(0.2, 5.0), rms=1.0, rng=rng),
        "random walk": 0.1 * np.cumsum(white),
        "random": white,
    }[kind]
    time_s = DT_S * np.arange(count // 2)
    columns = {"time_s": time_s, "command_v": sent[::2], "position_m": 0.1 + 0.0 * time_s}
    record = compare(make_record(columns))
    left_out = sent[1:-1:2] - 0.5 * (sent[:-2:2] + sent[2::2])
    found = unknown_commands(record)[: left_out.size]

    def rms(signal: FloatArray) -> float:
        return float(np.sqrt(np.mean(signal**2)))

    # The ratio r holds from one halving to the next within the factors of the docstring.
    assert 0.6 < rms(found) / rms(left_out) < 2.1
    # Where the command says nothing of its neighbours, none of them is likely to be small.
    least = float(found.min()) / rms(found)
    assert (least > 0.8) == (kind == "random")
