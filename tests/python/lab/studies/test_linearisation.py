# SPDX-License-Identifier: MIT
"""The rig's small-signal response: against the sampled linear model, and over the amplitude."""

from __future__ import annotations

from itertools import pairwise

import control
import numpy as np
import plant_runs as runs
import pytest
from sources import ROOT

import ehsid
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import SimulationError
from ehsid.lab.studies.linearisation import SmallSignal, small_signal_response

RIGS = ROOT / "examples" / "rigs"
DT_S = 0.05
LINEAR = read_rig(RIGS / "linear.toml")
BENCH = read_rig(RIGS / "bench.toml")


def sampled_linear(frequency_hz: np.ndarray, dt_s: float) -> np.ndarray:
    """Eq. (6), zero-order hold, evaluated by control."""
    theta = ehsid.discretise(runs.linear_servo(LINEAR.values), dt_s)
    system = control.tf(theta[3:], [1.0, *theta[:3]], dt_s)
    return np.asarray(system(np.exp(2j * np.pi * frequency_hz * dt_s)))


def relative(found: SmallSignal, truth: np.ndarray) -> np.ndarray:
    return np.abs(found.response / truth - 1.0)


@pytest.mark.parametrize("dt_s", [0.05, 0.005])
def test_a_linear_rig_gives_its_sampled_model(dt_s: float) -> None:
    found = small_signal_response(LINEAR, dt_s, amplitude_v=0.5)
    error = relative(found, sampled_linear(found.frequency_hz, dt_s))
    # Leapfrog at h = dt / substeps moves the natural frequency by (w h)^2 / 24. That shifts the
    # resonance, whose half width is xi, and turns the ringing at the end of a sample by w dt.
    servo = runs.linear_servo(LINEAR.values)
    substeps = 4 * ehsid.plant_substeps("linear", LINEAR.plant_values(), dt_s)
    moved = (servo.omega_n * dt_s / substeps) ** 2 / 24
    assert error.max() < moved * (1.0 / servo.xi + servo.omega_n * dt_s) + found.unsettled
    assert found.unsettled < 1e-4
    assert found.distortion < 1e-6
    assert found.frequency_hz[-1] < 0.5 / dt_s


def test_the_amplitude_does_not_matter_to_a_linear_rig() -> None:
    small, large = (small_signal_response(LINEAR, DT_S, amplitude_v=a) for a in (1e-3, 5.0))
    np.testing.assert_allclose(small.response, large.response, rtol=1e-9)


@pytest.mark.slow
def test_the_bench_tends_to_a_limit_as_the_amplitude_falls() -> None:
    """Halving the amplitude changes the response less and less, and so does its distortion."""
    found = [small_signal_response(BENCH, DT_S, amplitude_v=4.0 / 4**i) for i in range(6)]
    changes = [float(np.max(relative(one, two.response))) for one, two in pairwise(found[1:])]
    assert changes[-1] < 0.1 * changes[0]
    distortion = [one.distortion for one in found]
    assert all(two < one for one, two in pairwise(distortion))
    assert distortion[-1] < 1e-3


def test_velocity_gain_of_the_bench_by_hand() -> None:
    """At the lowest frequency G jw is the velocity gain: Q = Q_r sqrt(dp / dp_r) u / u_r, with the
    pressures of a rod at rest, p_a A_a = p_b A_b, that pass the same u both ways."""
    found = small_signal_response(BENCH, DT_S, amplitude_v=0.01)
    back = np.exp(-2j * np.pi * found.frequency_hz[0] * DT_S)
    gain = float(np.abs(found.response[0] * (1.0 - back))) / DT_S
    v = BENCH.values
    area_a = np.pi / 4 * v["cylinder.bore_m"] ** 2
    area_b = area_a - np.pi / 4 * v["cylinder.rod_m"] ** 2
    supply, tank = v["supply.pressure_pa"], v["supply.tank_pressure_pa"]
    orifice = v["valve.rated_flow_m3_s"] / np.sqrt(v["valve.rated_pressure_drop_pa"]) / 10.0
    gains = []
    for forward in (True, False):
        # Steady motion: both edges pass the rod's flow, and the pressures balance.
        # forward: c^2 (ps - pa) / Aa^2 = c^2 (pb - pt) / Ab^2; back: the other way round.
        into_a, into_b = (supply, tank) if forward else (tank, supply)
        balance = [[area_a, -area_b], [1 / area_a**2, 1 / area_b**2]]
        p_a, _ = np.linalg.solve(balance, [0.0, into_a / area_a**2 + into_b / area_b**2])
        drop = supply - p_a if forward else p_a - tank
        gains.append(orifice * np.sqrt(drop) / area_a)
    # The best linear response of a gain that differs between the ways lies between them.
    assert min(gains) * 0.97 < gain < max(gains) * 1.03


def test_what_cannot_be_excited_is_said() -> None:
    with pytest.raises(SimulationError, match="amplitude_v = 0"):
        small_signal_response(BENCH, DT_S, amplitude_v=0.0)
    with pytest.raises(SimulationError, match="leaves its stroke"):
        small_signal_response(BENCH, DT_S, amplitude_v=10.0, position0_m=0.29)
    with pytest.raises(SimulationError, match="outside the stroke"):
        small_signal_response(BENCH, DT_S, amplitude_v=0.1, position0_m=0.4)
    with pytest.raises(SimulationError, match="band_hz"):
        small_signal_response(BENCH, DT_S, amplitude_v=0.1, band_hz=(1.0, 20.0))


@pytest.mark.slow
def test_a_stuck_rig_does_not_move_and_nothing_breaks() -> None:
    """Inside a dead band the response is next to nothing."""
    dead = BENCH.with_values({"effects.valve_dead_band.overlap": 0.2})
    found = small_signal_response(dead, DT_S, amplitude_v=0.5)
    free = small_signal_response(BENCH, DT_S, amplitude_v=0.5)
    assert np.isfinite(found.response).all()
    assert np.abs(found.response[0]) < 0.05 * np.abs(free.response[0])
