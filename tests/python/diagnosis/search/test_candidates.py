# SPDX-License-Identifier: MIT
from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest

import ehsid
from ehsid.harness.catalogue.parameters import acts_on
from ehsid.harness.diagnosis import fit
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.fit import GAIN, Fit
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.scale import effect_starts
from ehsid.harness.diagnosis.search.candidates import (
    DECISION_SUBSTEPS,
    ITERATIONS_SCREEN,
    calibrate,
    decision_case,
    evaluate,
    linearised_start,
    nominal_candidate,
    refine,
    screen,
)
from ehsid.harness.diagnosis.search.intervals import matters
from ehsid.harness.diagnosis.search.search import with_usual_sizes
from ehsid.harness.records import make_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import multisine, triangle
from ehsid.harness.signals.simulation import (
    PositionController,
    draw_noise,
    simulate_closed_loop,
)

FRICTION = {**made.OFF, "effects.coulomb_friction.force_n": 400.0}


@pytest.fixture(scope="module")
def case() -> Case:
    return made.case_of(FRICTION)


def x_of(case: Case, effects: tuple[str, ...], values: dict[str, float]) -> np.ndarray:
    """The centres of the priors, except for the parameters with these values."""
    problem = case.problem(effects)
    x = problem.centre()
    for i, parameter in enumerate(problem.parameters):
        if parameter.name in values:
            x[i] = parameter.place(values[parameter.name])
    return x


def test_every_effect_that_is_fitted_has_active_starts() -> None:
    for effect in ehsid.effects():
        if effect.id == "sensor_quantisation":
            assert effect_starts(effect.id, made.RIG) == []
            continue
        for plant in ("bench", "axis", "linear"):
            rig = read_rig(made.RIGS / f"{plant}.toml")
            if not acts_on(effect, rig.plant):
                continue
            starts = effect_starts(effect.id, rig)
            assert starts
            for start in starts:
                placed = effect_parameters(effect.id, start, rig.plant)
                # The start is inside the range of the parameter, and not at its lower end.
                for parameter, x in placed:
                    start_value = start[parameter.name.split(".")[-1]]
                    assert parameter.value(x) == pytest.approx(start_value, rel=1e-9)
                assert any(value != 0.0 for value in start.values())


@pytest.mark.slow
def test_the_nominal_rig_is_not_fitted(case: Case) -> None:
    nominal = nominal_candidate(case)
    assert nominal.effects == ()
    for name, value in nominal.values.items():
        if name in made.RIG.values:
            assert value == pytest.approx(made.RIG.values[name], rel=1e-12), name
    problem = decision_case(case).problem()
    assert nominal.cost == problem.cost(problem.centre())
    # With the rig, the nuisances and the integration steps of the record, only noise remains.
    true = nominal_candidate(replace(made.case_of({}), substeps=made.SUBSTEPS))
    mse = true.squares.sum(axis=0) / true.counts.sum()
    # With 2700 samples, five standard deviations of the mean square are 14 %. Subtracting the mean
    # over 250 samples takes 0.4 % from the position; it also removes the error of the smoothed
    # measurement from which each window starts.
    np.testing.assert_allclose(mse, [5e-6**2, 1e4**2, 1e4**2], rtol=0.14)


def test_candidates_are_compared_on_held_out_records(case: Case) -> None:
    nominal = nominal_candidate(case)
    problem = decision_case(case).problem(held_out=True)
    errors = problem.errors(nominal.x)
    # Sums of squares by hand, window after window; the held-out cost has no prior.
    (record,) = problem.records
    windows = record.window[record.used]
    for column, name in enumerate(case.outputs):
        by_hand = [np.sum(errors[name][windows == number] ** 2) for number in np.unique(windows)]
        np.testing.assert_allclose(nominal.squares[:, column], by_hand, rtol=1e-12)
    assert nominal.counts.sum() == windows.size
    cost = problem.fit_cost(problem.coefficients(nominal.x))
    assert nominal.held_out_cost == pytest.approx(cost, rel=1e-12)
    # The powers are those of both parts, of the outputs in their order.
    for held_out, powers in ((True, nominal.powers), (False, nominal.fit_powers)):
        part = decision_case(case).problem(held_out=held_out)
        coefficients = part.coefficients(nominal.x)
        for column, name in enumerate(case.outputs):
            means = powers[:, column].sum(axis=0) / part.spectrum.sizes
            np.testing.assert_allclose(means, part.spectrum.powers(coefficients[name]), rtol=1e-12)


@pytest.mark.slow
def test_calibration_reaches_the_truth() -> None:
    case = made.case_of(made.OFF)
    calibrated = calibrate(case)
    subject = decision_case(case).problem()
    truth = x_of(case, (), made.OFF)
    # The minimum is no worse than the true values; a fit ends where a step gains less than GAIN.
    assert calibrated.cost <= subject.cost(truth) + 10.0 * GAIN
    assert calibrated.converged
    # At least noise^2 is tolerated, so that the weight of an octave is at most half of that for
    # noise alone. The gradient then scatters by at most H / 2, and noise moves the fit by at most
    # sqrt(1 / 2) of the deviations of H. Four such moves are rare.
    deviations = np.sqrt(np.diag(np.linalg.inv(subject.step(calibrated.x).hessian)))
    assert np.all(np.abs(calibrated.x - truth) < 4.0 * np.sqrt(0.5) * deviations)
    for name, value in made.OFF.items():
        assert calibrated.values[name] == pytest.approx(value, rel=0.05)
    # On held-out data, where neither was fitted, it is better than the rig as configured.
    assert nominal_candidate(case).held_out_cost - calibrated.held_out_cost > 100.0


@pytest.mark.slow
def test_any_other_start_can_only_help(case: Case) -> None:
    calibrated = calibrate(case)
    again = calibrate(case, [x_of(case, (), made.OFF), calibrated.x])
    assert again.cost <= calibrated.cost + GAIN


@pytest.mark.slow
def test_screening_takes_the_best_start(case: Case) -> None:
    # The calibration without the effect may be wrong: the values in the rig file are a start, too.
    fit_starts = [
        linearised_start(case, (), x) for x in (calibrate(case).x, case.problem().centre())
    ]
    screened = screen(case, ("coulomb_friction",), fit_starts)
    costs = []
    for start in effect_starts("coulomb_friction", case.rig):
        ((_, x),) = effect_parameters("coulomb_friction", start)
        for fit_start in fit_starts:
            short = fit(
                case.problem(("coulomb_friction",)),
                np.append(fit_start.x, x),
                iterations=ITERATIONS_SCREEN,
                first=fit_start.linear,
            )
            costs.append(short.cost)
    assert screened.cost == min(costs)
    assert screened.effects == ("coulomb_friction",)
    assert screened.values["effects.coulomb_friction.force_n"] == pytest.approx(400.0, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("offset", [-0.015, 0.02])
def test_screening_reaches_either_sign(offset: float) -> None:
    case = made.case_of({"effects.valve_null_bias.offset": offset})
    screened = screen(
        case, ("valve_null_bias",), [linearised_start(case, (), case.problem().centre())]
    )
    assert screened.values["effects.valve_null_bias.offset"] == pytest.approx(offset, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.12, 0.17, 0.21, 0.3, 0.55])
@pytest.mark.parametrize("amplitude_m", [1e-3, -2e-3])
def test_screening_finds_the_period_of_a_scale(share: float, amplitude_m: float) -> None:
    """The rod covers more than half of the stroke of 300 mm."""
    true = {
        "effects.sensor_nonlinearity.amplitude_m": amplitude_m,
        "effects.sensor_nonlinearity.period_m": 0.3 * share,
    }
    # From its middle position to both sides.
    command = np.roll(triangle(4000, made.DT_S, amplitude=5.2, period_s=4.0), -500)
    records = [
        made.measured(made.RIG, command, np.random.default_rng(seed), true) for seed in (1, 2)
    ]
    assert np.ptp(records[0].column("position_m")) > 0.16
    case = make_case(made.RIG, records[:1], records[1:])
    starts = [linearised_start(case, (), case.problem().centre())]
    screened = screen(case, ("sensor_nonlinearity",), starts)
    refined = refine(case, screened.effects, screened.x)
    for name, value in true.items():
        assert refined.values[name] == pytest.approx(value, rel=0.02), name


@pytest.mark.slow
def test_a_law_starts_from_the_simpler_law_that_it_contains() -> None:
    """Without this start a Stribeck curve can end with a static friction many times too high."""
    true = {
        "effects.stribeck_friction.coulomb_n": 400.0,
        "effects.stribeck_friction.static_n": 700.0,
        "effects.stribeck_friction.stribeck_velocity_m_s": 0.02,
    }
    case = made.case_of(true)
    fit_starts = [linearised_start(case, (), case.problem().centre())]
    simpler = screen(case, ("coulomb_friction",), fit_starts)
    screened = screen(case, ("stribeck_friction",), fit_starts)
    assert screened.cost < simpler.cost
    refined = refine(case, screened.effects, screened.x)
    for name, value in true.items():
        assert refined.values[name] == pytest.approx(value, rel=0.1), name


@pytest.mark.slow
def test_a_second_effect_starts_from_the_fit_with_the_first() -> None:
    true = {**FRICTION, "effects.valve_dead_band.overlap": 0.03}
    case = made.case_of(true)
    single = screen(case, ("coulomb_friction",), [linearised_start(case, (), calibrate(case).x)])
    pair = screen(
        case,
        (*single.effects, "valve_dead_band"),
        [linearised_start(case, single.effects, single.x)],
    )
    assert pair.effects == ("coulomb_friction", "valve_dead_band")
    refined = refine(case, pair.effects, pair.x)
    assert refined.cost <= pair.cost + GAIN
    for name, value in true.items():
        if name.startswith("effects."):
            assert refined.values[name] == pytest.approx(value, rel=0.05), name
    assert single.held_out_cost - refined.held_out_cost > 100.0


def test_the_long_fit_ends_with_the_decision_steps(case: Case) -> None:
    coarse = replace(case, substeps=2)
    assert decision_case(coarse).substeps == DECISION_SUBSTEPS
    assert decision_case(replace(case, substeps=9)).substeps == 9
    start = x_of(coarse, ("coulomb_friction",), FRICTION)
    refined = refine(coarse, ("coulomb_friction",), start)
    fine = decision_case(coarse).problem(("coulomb_friction",))
    assert refined.cost == pytest.approx(fine.cost(refined.x), rel=1e-12)
    # The cost is never above that of the start, and a second fit gains nothing.
    assert refined.cost <= fine.cost(start)
    again = refine(decision_case(coarse), ("coulomb_friction",), refined.x)
    assert refined.cost - again.cost == pytest.approx(0.0, abs=10.0 * GAIN)


@pytest.mark.slow
def test_a_limit_cycle_is_calibrated_from_distant_values() -> None:
    """A loop with too high a gain oscillates at its oil spring: the fit must not slip a period."""
    true = {
        "fluid.bulk_modulus_pa": 1.7e9,
        "load.mass_kg": 108.0,
        "cylinder.dead_volume_a_m3": 1.5e-4,
        "cylinder.dead_volume_b_m3": 1.7e-4,
        "supply.pressure_pa": 12.8e6,
    }
    controller = PositionController(3000.0, limit_v=10.0)
    records = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        reference = 0.15 + multisine(4000, 1e-3, band_hz=(0.5, 3.0), peak=0.01, rng=rng)
        run = simulate_closed_loop(
            made.RIG,
            reference,
            controller,
            dt_s=1e-3,
            values=true,
            noise=draw_noise(made.RIG, 4000, rng),
        ).run.record
        columns = {name: run.column(name) for name in ("command_v", *made.PRESSURES)}
        records.append(make_record({"time_s": run.time_s, **columns}))
    # The command does oscillate: many times per second from limit to limit.
    command = records[0].column("command_v")
    assert np.count_nonzero(np.diff(np.sign(command))) > 100
    case = make_case(made.RIG, records[:1], records[1:])
    calibrated = calibrate(case)
    problem = decision_case(case).problem()
    best = fit(problem, x_of(case, (), true))
    # With a wrong multiple of the frequency the errors are many times as large.
    for name in case.outputs:
        deviation = np.std(problem.errors(calibrated.x)[name])
        assert deviation < 2.0 * np.std(problem.errors(best.x)[name])


@pytest.mark.slow
def test_a_law_beyond_usual_sizes_is_fitted_again_with_the_largest_usual_one() -> None:
    """Of Stribeck friction that a fit left with ten times as much at rest as at speed."""
    case = made.case_of(FRICTION)
    problem = case.problem(("stribeck_friction",))
    sizes = {"coulomb_n": 400.0, "static_n": 4000.0, "stribeck_velocity_m_s": 2e-4}
    named = {f"effects.stribeck_friction.{name}": size for name, size in sizes.items()}
    x = problem.centre()
    for place, parameter in enumerate(problem.parameters):
        x[place] = parameter.place(named.get(parameter.name, parameter.value(x[place])))
    large = evaluate(case, ("stribeck_friction",), Fit(x, problem.cost(x), 0, True))
    usual = calibrate(case)
    found, same = with_usual_sizes(case, [large, usual])
    assert same is usual
    assert not matters("stribeck_friction", large.values, case.rig)
    static = found.values["effects.stribeck_friction.static_n"]
    # At rest three times what was held at speed then; what is held at speed is fitted again.
    assert 0.95 * 1200.0 < static <= 1200.0
    assert found.cost < large.cost
