# SPDX-License-Identifier: MIT
import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import ehsid
from ehsid.harness.excitation import multisine, triangle
from ehsid.harness.gap import fit
from ehsid.harness.gap.case import Case, make_case
from ehsid.harness.gap.parameters import effect_parameters
from ehsid.harness.gap.rivals import calibrate, fit_all, fit_effects
from ehsid.harness.gap.starts import effect_starts
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.parameters import acts_on
from ehsid.harness.simulation import (
    PositionController,
    draw_noise,
    simulate,
    simulate_closed_loop,
)

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
DT_S = 1e-3
NOISE = {"position_noise_m": 5e-6, "pressure_a_noise_pa": 1e4, "pressure_b_noise_pa": 1e4}
BENCH = read_rig(RIGS / "bench.toml").with_values(
    {"effects.valve_lag.bandwidth_hz": 0.0, "effects.valve_lag.damping": 0.0}
)
RIG = Rig("bench", "ehs", BENCH.values, sensors=NOISE)


def record(values: dict[str, float], seed: int, names: tuple[str, ...]) -> Record:
    """Multisine and slow triangle, 4 s."""
    rng = np.random.default_rng(seed)
    command = np.concatenate(
        [
            multisine(2000, DT_S, band_hz=(0.5, 25.0), rms=2.0, rng=rng),
            triangle(2000, DT_S, amplitude=0.8, period_s=1.0),
        ]
    )
    run = simulate(
        RIG, command, dt_s=DT_S, values=values, substeps=8, noise=draw_noise(RIG, 4000, rng)
    ).record
    columns = {name: run.column(name) for name in ("command_v", *names)}
    return make_record({"time_s": run.time_s, **columns})


def case_of(
    values: dict[str, float],
    names: tuple[str, ...] = ("position_m", "pressure_a_pa", "pressure_b_pa"),
) -> Case:
    return make_case(RIG, [record(values, 1, names)], [record(values, 2, names)])


def test_every_effect_that_is_fitted_has_active_starts() -> None:
    for effect in ehsid.effects():
        if effect.id == "sensor_quantisation":
            with pytest.raises(KeyError):
                effect_starts(effect.id, RIG)
            continue
        for plant in ("bench", "axis", "linear"):
            rig = read_rig(RIGS / f"{plant}.toml")
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


def test_a_case_goes_to_another_process_as_it_is() -> None:
    case = case_of({})
    again = pickle.loads(pickle.dumps(case))
    assert again.outputs == case.outputs
    assert again.rig.values == case.rig.values
    problem = case.problem()
    x = problem.centre()
    assert again.problem().cost(x) == problem.cost(x)


def test_outputs_that_do_not_move_are_left_out() -> None:
    case = case_of({}, ("position_m", "supply_pressure_pa"))
    assert case.outputs == ("position_m",)
    assert case.left_out == ("supply_pressure_pa",)


def test_without_a_gap_nothing_gains_on_held_out_data() -> None:
    case = case_of({"fluid.bulk_modulus_pa": 0.9e9})
    calibrated = calibrate(case)
    rivals = fit_all(
        case, [("coulomb_friction",), ("valve_dead_band",), ("transport_delay",)], [calibrated.x]
    )
    for rival in rivals:
        # A free parameter gains half a nat by chance; five standard deviations of that.
        assert calibrated.held_out_cost - rival.held_out_cost < 4.0, rival.effects


@pytest.mark.parametrize(
    ("effect", "value"),
    [
        ("coulomb_friction.force_n", 400.0),
        ("valve_dead_band.overlap", 0.03),
        ("internal_leakage.coefficient_m3_s_pa", 2e-11),
        ("transport_delay.delay_s", 0.005),
    ],
)
def test_the_effect_that_was_put_in_wins_on_held_out_data(effect: str, value: float) -> None:
    case = case_of({"fluid.bulk_modulus_pa": 0.9e9, f"effects.{effect}": value})
    calibrated = calibrate(case)
    ids = [
        ("coulomb_friction",),
        ("valve_dead_band",),
        ("internal_leakage",),
        ("transport_delay",),
    ]
    rivals = fit_all(case, ids, [calibrated.x])
    assert [rival.effects for rival in rivals] == ids
    best = min(rivals, key=lambda rival: rival.held_out_cost)
    assert best.effects == (effect.split(".")[0],)
    assert best.values[f"effects.{effect}"] == pytest.approx(value, rel=0.05)
    assert calibrated.held_out_cost - best.held_out_cost > 100.0


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
        reference = 0.15 + multisine(4000, DT_S, band_hz=(0.5, 3.0), peak=0.01, rng=rng)
        run = simulate_closed_loop(
            RIG, reference, controller, dt_s=DT_S, values=true, noise=draw_noise(RIG, 4000, rng)
        ).run.record
        columns = ("command_v", "position_m", "pressure_a_pa", "pressure_b_pa")
        records.append(
            make_record({"time_s": run.time_s, **{name: run.column(name) for name in columns}})
        )
    # It does swing: many times a second from limit to limit.
    command = records[0].column("command_v")
    assert np.count_nonzero(np.diff(np.sign(command))) > 100
    case = make_case(RIG, records[:1], records[1:])
    found = calibrate(case)
    problem = case.problem()
    at_truth = problem.centre()
    for i, parameter in enumerate(problem.parameters):
        if parameter.name in true:
            at_truth[i] = parameter.place(true[parameter.name])
    best = fit(problem, at_truth)
    # A wrong multiple of the cycle is off by seventy times as much: position by half a millimetre.
    for name in case.outputs:
        left = np.std(problem.errors(found.x)[name])
        assert left < 2.0 * np.std(problem.errors(best.x)[name])


def test_two_effects_are_found_together() -> None:
    true = {"effects.coulomb_friction.force_n": 400.0, "effects.valve_dead_band.overlap": 0.03}
    case = case_of(true)
    calibrated = calibrate(case)
    found = fit_effects(case, ("coulomb_friction", "valve_dead_band"), [calibrated.x])
    for name, value in true.items():
        assert found.values[name] == pytest.approx(value, rel=0.05)
    assert math.isfinite(found.held_out_cost)


def test_nothing_in_common_is_said() -> None:
    still = record({}, 1, ("position_m",))
    with pytest.raises(ValueError, match="one that is held out"):
        make_case(RIG, [still], [])
