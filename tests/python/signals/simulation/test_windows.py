# SPDX-License-Identifier: MIT

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT
from windowed_runs import simulate_windows

from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import measured_states, simulate
from ehsid.harness.signals.simulation.windows import window_numbers

RIG = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
DT_S = 1e-3
TRUE = {"effects.load_force.force_n": 800.0, "effects.valve_hysteresis.half_width": 0.01}


@pytest.fixture(scope="module")
def record() -> Record:
    command = np.repeat(np.random.default_rng(4).uniform(-3.0, 3.0, 40), 50)
    return simulate(RIG, command, dt_s=DT_S, values=TRUE, substeps=4).record


@given(
    samples=st.integers(100, 3000),
    length=st.integers(2, 400),
    skipped=st.integers(0, 99),
)
def test_windows_cover_the_record_behind_its_start(samples: int, length: int, skipped: int) -> None:
    window = window_numbers(samples, DT_S, window_s=length * DT_S, skip_s=skipped * DT_S)
    assert np.all(window[:skipped] == -1)
    numbers, counts = np.unique(window[skipped:], return_counts=True)
    np.testing.assert_array_equal(numbers, np.arange(numbers.size))
    assert np.all(counts[:-1] == length)


@pytest.mark.parametrize("reset", ["carry", "estimate"])
def test_the_true_rig_reproduces_its_record(record: Record, reset: str) -> None:
    run = simulate_windows(RIG, record, reset=reset, value_sets=[TRUE], substeps=4)
    for name in ("position_m", "pressure_a_pa", "spool"):
        error = run.outputs[name][0] - record.column(name)
        # A reset of a state to the same value changes it by rounding only, the speed by the
        # rounding of half a step back and forth.
        assert np.max(np.abs(error)) < 1e-9 * np.ptp(record.column(name)), name


def test_carrying_over_means_the_position_is_right_at_each_window(record: Record) -> None:
    run = simulate_windows(RIG, record)
    window_starts = np.flatnonzero(np.diff(run.window, prepend=-1) > 0)
    assert window_starts.size == 4
    error = run.outputs["position_m"][0] - record.column("position_m")
    assert np.all(np.abs(error[window_starts]) < 1e-12)
    # Without the load and the play of the record, the windows end elsewhere and the pressures keep
    # an error.
    assert np.all(np.abs(error[window_starts[1:] - 1]) > 1e-5)
    p_a = run.outputs["pressure_a_pa"][0] - record.column("pressure_a_pa")
    assert np.all(np.abs(p_a[window_starts[1:]]) > 1e4)


def test_estimating_sets_pressures_and_speed_too(record: Record) -> None:
    run = simulate_windows(RIG, record, reset="estimate")
    window_starts = np.flatnonzero(np.diff(run.window, prepend=-1) > 0)
    for name in ("position_m", "pressure_a_pa", "pressure_b_pa"):
        error = run.outputs[name][0] - record.column(name)
        assert np.all(np.abs(error[window_starts]) < 1e-9 * np.ptp(record.column(name))), name
    # The speed at the sample is the measured one, whichever forces the rig lacks.
    speed = run.outputs["velocity_m_s"][0] - record.column("velocity_m_s")
    assert np.all(np.abs(speed[window_starts]) < 1e-9 * np.ptp(record.column("velocity_m_s")))


def speed_gain(hz: float) -> float:
    """Share of the slope of a sine in a least-squares cubic over 11 samples of 1 ms."""
    k = np.arange(-5, 6)
    # y = c_0 + c_1 k + c_2 k^2 + c_3 k^3: the second row of the pseudo-inverse gives the slope.
    weights = np.linalg.pinv(np.vander(k, 4, increasing=True).astype(float))[1]
    turn = 2.0 * np.pi * hz * DT_S
    # The weights are odd in k. Of sin(w t + phase) remains sum h_k sin(w k dt) cos(w t + phase).
    return float(weights @ np.sin(turn * k)) / turn


@given(hz=st.floats(0.5, 150.0), phase=st.floats(0.0, 6.0))
def test_speed_from_the_position_where_none_is_measured(hz: float, phase: float) -> None:
    time = np.arange(1000) * DT_S
    w = 2.0 * np.pi * hz
    position = 0.1 + 0.01 * np.sin(w * time + phase)
    states = measured_states(
        make_record({"time_s": time, "command_v": np.zeros(1000), "position_m": position})
    )
    assert np.isnan(states[:, 2:]).all()
    np.testing.assert_array_equal(states[:, 0], position)
    speed = 0.01 * w * np.cos(w * time + phase)
    # Rounding of 0.1 in double over 1 ms, times weights whose absolute sum is less than 1.
    error = states[5:-5, 1] - speed_gain(hz) * speed[5:-5]
    assert np.max(np.abs(error)) < 1e-9 * 0.01 * w + 1e-12


def test_the_speed_of_an_oil_spring_is_preserved() -> None:
    assert speed_gain(70.0) == pytest.approx(0.95, abs=0.005)
    # Noise is averaged: the deviation of the slope is this share of deviation / dt.
    rng = np.random.default_rng(0)
    noise = 1e-6 * rng.standard_normal(20000)
    states = measured_states(
        make_record(
            {
                "time_s": np.arange(20000) * DT_S,
                "command_v": np.zeros(20000),
                "position_m": 0.1 + noise,
            }
        )
    )
    # A central difference would have 1 / sqrt(2) = 0.71; the root of the sum of squared weights is
    # 0.25. With 20000 draws that are correlated over 11 samples, five standard errors are 9 %.
    k = np.arange(-5, 6)
    weights = np.linalg.pinv(np.vander(k, 4, increasing=True).astype(float))[1]
    expected = 1e-6 / DT_S * np.sqrt(np.sum(weights**2))
    assert np.std(states[5:-5, 1]) == pytest.approx(expected, rel=0.09)


def test_sensitivities_are_differences(record: Record) -> None:
    name = "load.viscous_friction_n_s_m"
    run = simulate_windows(RIG, record, value_sets=[TRUE, {}], varied=[name, "load.mass_kg"])
    assert run.sensitivities["position_m"].shape == (2, len(record), 2)
    h = 1e-4 * RIG.values[name]
    up, down = (
        simulate_windows(RIG, record, value_sets=[{**TRUE, name: RIG.values[name] + side}])
        for side in (h, -h)
    )
    for output in ("position_m", "pressure_a_pa"):
        difference = (up.outputs[output] - down.outputs[output])[0] / (2.0 * h)
        sensitivity = run.sensitivities[output][0, :, 0]
        assert np.max(np.abs(sensitivity - difference)) < 1e-3 * np.max(np.abs(difference))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"window_s": 1e-3}, "windows of at least two samples"),
        ({"skip_s": 5.0}, "a start within the record"),
        ({"value_sets": [{"load.mass_kg": -1.0}]}, "'load.mass_kg' = -1"),
    ],
)
def test_invalid_arguments_are_refused(
    record: Record, change: dict[str, object], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        simulate_windows(RIG, record, **change)  # type: ignore[arg-type]


def test_a_record_with_a_gap_is_refused(record: Record) -> None:
    time = np.array(record.time_s)
    time[500:] += 0.5
    record_with_gap = make_record(
        {"time_s": time, "command_v": np.zeros(time.size), "position_m": np.zeros(time.size)}
    )
    with pytest.raises(ValueError, match="cut the record at its gaps"):
        simulate_windows(RIG, record_with_gap)
