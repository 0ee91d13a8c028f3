# SPDX-License-Identifier: MIT
from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest

import ehsid
from ehsid.harness.catalogue.parameters import acts_on
from ehsid.harness.excitation import multisine
from ehsid.harness.gap import fit
from ehsid.harness.gap.inference.rivals import (
    SLEW,
    as_told,
    base,
    calibrate,
    decisive,
    polish,
    screen,
    values_as_told,
)
from ehsid.harness.gap.model.case import Case, make_case
from ehsid.harness.gap.model.fit import GAIN
from ehsid.harness.gap.model.machine import effect_starts
from ehsid.harness.gap.model.parameters import effect_parameters
from ehsid.harness.gap.thresholds import DECISION_SUBSTEPS, ITERATIONS_SCREEN
from ehsid.harness.records import make_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.simulation import PositionController, draw_noise, simulate, simulate_closed_loop

FRICTION = {**made.OFF, "effects.coulomb_friction.force_n": 400.0}


@pytest.fixture(scope="module")
def case() -> Case:
    return made.case_of(FRICTION)


def x_of(case: Case, effects: tuple[str, ...], values: dict[str, float]) -> np.ndarray:
    """Priors' centres, with these values in their places."""
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
            assert len(starts) >= 2
            for start in starts:
                placed = effect_parameters(effect.id, start, rig.plant)
                # Where it is told to start is inside its range, and not at its lower end.
                for parameter, x in placed:
                    told = start[parameter.name.split(".")[-1]]
                    assert parameter.value(x) == pytest.approx(told, rel=1e-9)
                assert any(value != 0.0 for value in start.values())


def test_the_rig_as_told_is_not_fitted(case: Case) -> None:
    told = as_told(case)
    assert told.effects == ()
    for name, value in told.values.items():
        if name in made.RIG.values:
            assert value == pytest.approx(made.RIG.values[name], rel=1e-12), name
    problem = decisive(case).problem()
    assert told.cost == problem.cost(problem.centre())
    # Where rig, nuisances and steps of integration are those of the record, the noise is left.
    true = as_told(replace(made.case_of({}), substeps=made.SUBSTEPS))
    mse = true.squares.sum(axis=0) / true.counts.sum()
    # 2700 samples: five deviations of their mean square are 14 %. The position has lost its mean
    # over 250 samples, 0.4 %; it starts each window from a smoothed measurement, which the mean
    # takes away.
    np.testing.assert_allclose(mse, [5e-6**2, 1e4**2, 1e4**2], rtol=0.14)


def test_rivals_are_judged_on_what_was_held_out(case: Case) -> None:
    told = as_told(case)
    problem = decisive(case).problem(held_out=True)
    errors = problem.errors(told.x)
    # Sums of squares by hand, window after window; J's first sum has no prior in it.
    (record,) = problem.records
    windows = record.window[record.used]
    for column, name in enumerate(case.outputs):
        by_hand = [np.sum(errors[name][windows == number] ** 2) for number in np.unique(windows)]
        np.testing.assert_allclose(told.squares[:, column], by_hand, rtol=1e-12)
    assert told.counts.sum() == windows.size
    floors = np.array([case.floors[name].value for name in case.outputs])
    mse = told.squares.sum(axis=0) / told.counts.sum()
    independent = 20.0 * record.seconds
    by_hand = 0.5 * independent * np.log(mse + floors**2).sum()
    assert told.held_out_cost == pytest.approx(by_hand, rel=1e-12)


def test_calibration_reaches_the_truth() -> None:
    case = made.case_of(made.OFF)
    found = calibrate(case)
    subject = decisive(case).problem()
    truth = x_of(case, (), made.OFF)
    # It is at a minimum no worse than the truth; a fit ends where a step gains less than GAIN.
    assert found.cost <= subject.cost(truth) + 10.0 * GAIN
    assert found.converged
    # 20 independent errors a second count, 500 went in: noise alone moves the fit by a fifth of
    # the deviations of the cost's own Hessian, five of these are one.
    deviations = np.sqrt(np.diag(np.linalg.inv(subject.step(found.x).hessian)))
    assert np.all(np.abs(found.x - truth) < deviations)
    for name, value in made.OFF.items():
        assert found.values[name] == pytest.approx(value, rel=0.05)
    # And it beats the rig as configured where neither was fitted.
    assert as_told(case).held_out_cost - found.held_out_cost > 100.0


def test_any_other_start_can_only_help(case: Case) -> None:
    alone = calibrate(case)
    again = calibrate(case, [x_of(case, (), made.OFF), alone.x])
    assert again.cost <= alone.cost + GAIN


def test_a_first_look_takes_the_best_of_the_sizes(case: Case) -> None:
    # The calibration without the effect may have gone astray: the values as told are a base, too.
    bases = [base(case, (), x) for x in (calibrate(case).x, case.problem().centre())]
    found = screen(case, ("coulomb_friction",), bases)
    costs = []
    for start in effect_starts("coulomb_friction", case.rig):
        ((_, x),) = effect_parameters("coulomb_friction", start)
        for one in bases:
            short = fit(
                case.problem(("coulomb_friction",)),
                np.append(one.x, x),
                iterations=ITERATIONS_SCREEN,
                first=one.linear,
            )
            costs.append(short.cost)
    assert found.cost == min(costs)
    assert found.effects == ("coulomb_friction",)
    assert found.values["effects.coulomb_friction.force_n"] == pytest.approx(400.0, rel=0.05)


@pytest.mark.parametrize("offset", [-0.015, 0.02])
def test_a_first_look_finds_either_sign(offset: float) -> None:
    case = made.case_of({"effects.valve_null_bias.offset": offset})
    found = screen(case, ("valve_null_bias",), [base(case, (), case.problem().centre())])
    assert found.values["effects.valve_null_bias.offset"] == pytest.approx(offset, rel=0.05)


def test_a_law_starts_from_the_simpler_one_that_it_holds() -> None:
    """From sizes alone Stribeck's curve can end with a static friction many times too high."""
    true = {
        "effects.stribeck_friction.coulomb_n": 400.0,
        "effects.stribeck_friction.static_n": 700.0,
        "effects.stribeck_friction.stribeck_velocity_m_s": 0.02,
    }
    case = made.case_of(true)
    bases = [base(case, (), case.problem().centre())]
    simpler = screen(case, ("coulomb_friction",), bases)
    found = screen(case, ("stribeck_friction",), bases)
    assert found.cost < simpler.cost
    long = polish(case, found.effects, found.x)
    for name, value in true.items():
        assert long.values[name] == pytest.approx(value, rel=0.1), name


def test_a_slow_spool_is_found_though_its_limit_has_no_slope() -> None:
    rng = np.random.default_rng(8)
    levels = np.repeat(rng.uniform(-8.0, 8.0, 60), 100)
    run = simulate(made.RIG, levels, dt_s=1e-3, values={SLEW: 120.0}, substeps=8).record
    columns = {name: run.column(name) for name in ("command_v", *made.PRESSURES)}
    noise = {"position_m": 5e-6, "pressure_a_pa": 1e4, "pressure_b_pa": 1e4}
    for name, deviation in noise.items():
        columns[name] = columns[name] + deviation * rng.standard_normal(levels.size)
    case = make_case(made.RIG, [make_record({"time_s": run.time_s, **columns})])
    # A step of 8 V at 120 a second takes 7 ms; the limit is known to some per cent.
    assert calibrate(case).values[SLEW] == pytest.approx(120.0, rel=0.1)


def test_values_as_told_stay_and_nuisances_move() -> None:
    case = made.case_of({"fluid.bulk_modulus_pa": 0.6e9, "nuisance.flow_exponent": 0.53})
    calibrated = calibrate(case)
    untouched = values_as_told(case, calibrated)
    for name, value in untouched.values.items():
        if not name.startswith("nuisance."):
            assert value == pytest.approx(made.RIG.values[name], rel=1e-9), name
    assert untouched.values["nuisance.flow_exponent"] != pytest.approx(0.5, abs=1e-3)
    assert calibrated.cost < untouched.cost < as_told(case).cost


def test_a_second_effect_starts_where_the_first_was_found() -> None:
    true = {**FRICTION, "effects.valve_dead_band.overlap": 0.03}
    case = made.case_of(true)
    one = screen(case, ("coulomb_friction",), [base(case, (), calibrate(case).x)])
    both = screen(case, (*one.effects, "valve_dead_band"), [base(case, one.effects, one.x)])
    assert both.effects == ("coulomb_friction", "valve_dead_band")
    long = polish(case, both.effects, both.x)
    assert long.cost <= both.cost + GAIN
    for name, value in true.items():
        if name.startswith("effects."):
            assert long.values[name] == pytest.approx(value, rel=0.05), name
    assert one.held_out_cost - long.held_out_cost > 100.0


def test_the_long_fit_is_at_the_steps_that_decide(case: Case) -> None:
    coarse = replace(case, substeps=2)
    assert decisive(coarse).substeps == DECISION_SUBSTEPS
    assert decisive(replace(case, substeps=9)).substeps == 9
    start = x_of(coarse, ("coulomb_friction",), FRICTION)
    long = polish(coarse, ("coulomb_friction",), start)
    fine = decisive(coarse).problem(("coulomb_friction",))
    assert long.cost == pytest.approx(fine.cost(long.x), rel=1e-12)
    # Never worse than where it began, and once more it has nothing to gain.
    assert long.cost <= fine.cost(start)
    again = polish(decisive(coarse), ("coulomb_friction",), long.x)
    assert long.cost - again.cost == pytest.approx(0.0, abs=10.0 * GAIN)


def test_a_limit_cycle_is_calibrated_from_afar() -> None:
    """A loop of too high a gain swings at its oil spring: the fit must not lose count."""
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
    # It does swing: many times a second from limit to limit.
    command = records[0].column("command_v")
    assert np.count_nonzero(np.diff(np.sign(command))) > 100
    case = make_case(made.RIG, records[:1], records[1:])
    found = calibrate(case)
    problem = decisive(case).problem()
    best = fit(problem, x_of(case, (), true))
    # A wrong multiple of the cycle is off by many times as much.
    for name in case.outputs:
        left = np.std(problem.errors(found.x)[name])
        assert left < 2.0 * np.std(problem.errors(best.x)[name])
