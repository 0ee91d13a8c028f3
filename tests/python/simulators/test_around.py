# SPDX-License-Identifier: MIT
"""Effects around a simulator against the same effects inside of ours, and against its equations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from bench_loops import drooping, leaking, rubbing
from user_simulators import FOLDER, needs_linux64

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.simulators.around import Told, catches
from ehsid.harness.simulators.runs import SimulatorRuns, opened_runs

DT = 1e-3
NAMES = list(plant_parameters())


def plant_values(**values: float) -> FloatArray:
    """Our servo with a spool that follows at once and edges without rounding, and these values."""
    all_values = np.array([plant_parameters()[name].typical for name in NAMES])
    for k, name in enumerate(NAMES):
        if name.startswith("effects."):
            all_values[k] = 0.0
    given = {"nuisance.spool_bandwidth_hz": 0.0, "nuisance.edge_rounding": 1e-4, **values}
    for name, value in given.items():
        all_values[NAMES.index(name)] = value
    return all_values


def command() -> FloatArray:
    time = np.arange(1500) * DT
    return 3.0 * np.sin(2 * np.pi * 1.5 * time) + 1.5 * np.sign(np.sin(2 * np.pi * 4.0 * time))


def around_our_plant(values: FloatArray) -> FloatArray:
    """Outputs of our plant without effects, stepped as a user's simulator, with effects around."""
    inner = values.copy()
    for k, name in enumerate(NAMES):
        if name.startswith("effects."):
            inner[k] = 0.0
    plant = ehsid.Plant("ehs", inner, dt_s=DT, substeps=4)

    def read() -> list[float]:
        return [float(number) for number in plant.read()[:4]]

    def step(_h: float, inputs: list[float]) -> list[float]:
        plant.advance(inputs[0])
        return read()

    u = command()
    outputs, whole = ehsid.run_steps(
        read,
        step,
        ["command_v"],
        ["position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa"],
        values,
        u,
        dt_s=DT,
        substeps=1,
        measured=np.zeros_like(u),
        caught=np.zeros(u.size, np.uint8),
        gain=0.0,
        mass=0.0,
        stiffness=(0.0, 0.0),
        valve=(0.0, 0.0),
    )
    assert whole
    return outputs


# Effects whose command is held over a sample act the same outside; what changes within a sample
# (lag, drift) is held there by its mean, which moves it by less than half a sample.
@pytest.mark.parametrize(
    ("values", "share"),
    [
        ({"effects.transport_delay.delay_s": 0.006}, 1e-9),
        ({"effects.valve_hysteresis.half_width": 0.04}, 1e-9),
        ({"effects.spool_stiction.threshold": 0.05}, 1e-9),
        ({"effects.valve_null_bias.offset": 0.03}, 1e-9),
        ({"effects.valve_flow_saturation.limit": 0.3}, 1e-9),
        ({"effects.valve_dead_band.overlap": 0.05}, 1e-3),
        ({"effects.valve_lag.bandwidth_hz": 30.0, "effects.valve_lag.damping": 0.8}, 5e-3),
        ({"effects.flow_gain_drift.rate_1_s": 0.05}, 2e-3),
        ({"effects.sensor_backlash.half_width_m": 3e-4}, 1e-3),
        ({"effects.sensor_lag.time_constant_s": 0.01}, 1e-2),
        ({"effects.position_sensor_delay.delay_s": 0.0065}, 1e-3),
        ({"effects.pressure_sensor_gain.gain_a": 1.1}, 1e-9),
        ({"effects.pressure_sensor_offset.offset_a_pa": 3e5}, 1e-9),
        ({"effects.pressure_sensor_lag.time_constant_s": 0.01}, 1e-2),
    ],
)
def test_an_effect_outside_acts_as_it_does_inside(
    values: Mapping[str, float], share: float
) -> None:
    all_values = plant_values(**values)
    inside, _ = ehsid.simulate_plant("ehs", all_values[None], command(), dt_s=DT, substeps=4)
    without, _ = ehsid.simulate_plant("ehs", plant_values()[None], command(), dt_s=DT, substeps=4)
    outside = around_our_plant(all_values)
    (name,) = (name.split(".")[1] for name in list(values)[:1])
    columns = (2,) if name.startswith("pressure_") else (0,) if "sensor" in name else (0, 2)
    for column in columns:
        effect = np.std(inside[0, :, column] - without[0, :, column])
        assert effect > 0.0
        error = np.std(outside[:, column] - inside[0, :, column])
        assert error <= max(share, 1e-12) * np.ptp(inside[0, :, column])
        assert error < 0.1 * effect


def test_the_inverse_of_the_valve_s_lag_puts_a_dead_band_behind_it() -> None:
    """Through the lag of the simulator's valve comes what a dead band behind the lag would give."""
    values = plant_values(**{"effects.valve_dead_band.overlap": 0.035})
    u = 1.0 * np.sin(2 * np.pi * 10.0 * np.arange(1000) * DT)
    valve = (80.0, 0.9)
    lag = plant_values(
        **{"effects.valve_lag.bandwidth_hz": valve[0], "effects.valve_lag.damping": valve[1]}
    )

    def lagged(sent: FloatArray) -> FloatArray:
        return ehsid.outside_command(lag, sent, dt_s=DT)

    wanted = lagged(u)
    wanted = np.sign(wanted) * np.maximum(np.abs(wanted) - 0.35, 0.0)
    errors = {}
    for known in (valve, (0.0, 0.0)):
        sent = ehsid.outside_command(values, u, dt_s=DT, valve=known)
        errors[known] = np.std((lagged(sent) - wanted)[200:]) / np.std(wanted[200:])
    assert errors[valve] < 0.05
    assert errors[valve] < 0.5 * errors[(0.0, 0.0)]


@pytest.fixture(scope="module")
def bench() -> SimulatorRuns:
    with opened_runs(read_rig(FOLDER / "rig.toml")) as runs:
        yield runs


def outputs_with(runs: SimulatorRuns, u: FloatArray, dt_s: float, **effects: float) -> FloatArray:
    told = Told(u, np.zeros_like(u), np.zeros(u.size, np.uint8), dt_s)
    rig = runs.rig
    own = [value for name, value in rig.values.items() if name.startswith("simulator.")]
    return runs.outputs(told, np.hstack([rig.plant_values(effects), own]))


@needs_linux64
def test_what_short_runs_measure(bench: SimulatorRuns) -> None:
    """Mass and stiffness are those of the bench, less what the oil gives within a step."""
    measured = bench.measured
    assert measured.mass_kg == pytest.approx(150.0, rel=0.05)
    area_a, area_b = np.pi / 4 * 0.063**2, np.pi / 4 * (0.063**2 - 0.036**2)
    stiffness = 1e9 / (3e-4 + area_a * 0.175), 1e9 / (2.6e-4 + area_b * 0.175)
    assert measured.stiffness_pa_m3 == pytest.approx(stiffness, rel=0.05)
    assert 0.01 < measured.speed_per_volt < 0.1


@needs_linux64
@pytest.mark.parametrize(
    ("effects", "loop"),
    [
        ({"effects.coulomb_friction.force_n": 800.0}, rubbing),
        ({"effects.internal_leakage.coefficient_m3_s_pa": 8e-12}, leaking),
        (
            {
                "effects.supply_droop.source_resistance_pa_s_m3": 1e10,
                "effects.supply_droop.accumulator_capacitance_m3_pa": 2e-12,
            },
            drooping,
        ),
    ],
)
def test_an_effect_through_a_port_is_that_of_fine_steps(
    bench: SimulatorRuns, effects: Mapping[str, float], loop: object
) -> None:
    """At 1 ms an effect through a port is what the equations give at 0.1 ms."""
    u = 2.0 * np.sin(2 * np.pi * 1.5 * np.arange(1200) * DT)
    fine = loop(u, DT, *effects.values())  # type: ignore[operator]
    coarse, without = outputs_with(bench, u, DT, **effects), outputs_with(bench, u, DT)
    for column in (0, 2, 3):
        effect = np.std(fine[:, column] - without[:, column])
        assert np.std(coarse[:, column] - fine[:, column]) < 0.06 * effect


@needs_linux64
def test_a_caught_simulator_follows_a_record_of_its_machine(bench: SimulatorRuns) -> None:
    """With the true values and the true cause what is left is small, without the cause it is not.

    The shares are those of a simulator without bristles and with equal edges on this machine.
    """
    record = read_record(FOLDER / "coulomb.csv")
    assert record.dt_s is not None
    window, caught = catches(len(record), record.dt_s, window_s=0.5, first_s=0.3)
    told = Told(record.column("command_v"), record.column("position_m"), caught, record.dt_s)
    true = [143.83, 1621.7, 1.15835e9, 5.3857e-4, 84.6078]
    gaps = []
    for friction in (0.0, 800.0):
        values = bench.rig.plant_values({"effects.coulomb_friction.force_n": friction})
        outputs = bench.outputs(told, np.hstack([values, true]))
        of_pressure = []
        for column, name in ((0, "position_m"), (2, "pressure_a_pa")):
            measured = record.column(name)
            errors = squares = 0.0
            for number in range(window.max() + 1):
                inside = window == number
                error = outputs[inside, column] - measured[inside]
                error -= error.mean() if column == 0 else 0.0
                errors += float(np.sum(error**2))
                squares += float(np.sum((measured[inside] - measured[inside].mean()) ** 2))
            of_pressure.append(np.sqrt(errors / squares))
        gaps.append(of_pressure)
    assert gaps[1][0] < 0.005
    assert gaps[1][1] < 0.1
    assert gaps[0][0] > 2.0 * gaps[1][0]
    assert gaps[0][1] > 2.0 * gaps[1][1]


def test_windows_follow_a_catch_and_a_rest() -> None:
    window, caught = catches(5000, 2e-3, window_s=0.5, first_s=0.3)
    assert np.count_nonzero(window == 3) == 250
    begins = np.flatnonzero(np.diff(window, prepend=-1) > 0)
    assert begins[0] == round(0.36 / 2e-3)
    assert set(np.diff(begins)) == {round(0.76 / 2e-3)}
    assert not np.any(caught[window >= 0])
    assert np.count_nonzero(caught[begins[0] : begins[1]]) == round(0.2 / 2e-3)
