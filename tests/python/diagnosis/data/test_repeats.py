# SPDX-License-Identifier: MIT

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter
from sources import ROOT

from ehsid.harness.diagnosis.data.floor import floor_of, noise_floor, sensor_step, shows_motion
from ehsid.harness.diagnosis.data.repeats import (
    find_repeat,
    repeat_errors,
    rest_errors,
    rest_windows,
)
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import simulate

DT_S = 1e-3
RIG = read_rig(ROOT / "examples" / "rigs" / "bench.toml")


def coloured(n: int, sigma: float, corner_hz: float, seed: int) -> np.ndarray:
    """First-order noise x_k = a x_{k-1} + e_k of deviation sigma."""
    a = np.exp(-2.0 * np.pi * corner_hz * DT_S)
    white = np.random.default_rng(seed).standard_normal(n) * sigma * np.sqrt(1.0 - a * a)
    return np.asarray(lfilter([1.0], [1.0, -a], white))


def record_of(command: np.ndarray, position: np.ndarray, dt_s: float = DT_S) -> Record:
    time = np.arange(command.size) * dt_s
    return make_record({"time_s": time, "command_v": command, "position_m": position})


@pytest.mark.slow
@given(
    period=st.integers(200, 2500),
    before=st.integers(0, 1500),
    after=st.integers(0, 1500),
    seed=st.integers(0, 1000),
)
def test_a_repeated_stretch_is_detected(period: int, before: int, after: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    period_samples = rng.standard_normal(period)
    command = np.concatenate(
        [
            rng.standard_normal(before),
            period_samples,
            period_samples,
            period_samples,
            rng.standard_normal(after),
            np.zeros(300),
        ]
    )
    repeat = find_repeat(command, 2 * period)
    assert repeat is not None
    assert (repeat.lag, repeat.first, repeat.last) == (period, before, before + 2 * period)
    assert find_repeat(command, 2 * period + 1) is None


def test_constant_commands_and_noise_are_no_repeats() -> None:
    steps = np.repeat([0.0, 1.0, 0.0, 1.0, 0.0], 1000)
    assert find_repeat(steps, 100) is None
    assert find_repeat(np.random.default_rng(0).standard_normal(5000), 100) is None


def test_repeats_show_coloured_noise_in_motion() -> None:
    rng = np.random.default_rng(1)
    period = multisine(4000, DT_S, band_hz=(0.5, 20.0), peak=2.0, rng=rng)
    run = simulate(RIG, np.tile(period, 4), dt_s=DT_S, position0_m=0.15).record
    sigma = 1e-5
    noise = coloured(16000, sigma, 30.0, 2)
    record = record_of(np.tile(period, 4), run.column("position_m") + noise)
    floor = floor_of(record, "position_m")
    # The differences contain only the highest frequencies; repeats contain all frequencies above
    # that of a window. There are about 2 x 30 Hz x 12 s / 2 independent samples, which gives a
    # standard error of 2.6 %; the tolerance is four of these.
    assert noise_floor(record.column("position_m")).value < 0.6 * sigma
    assert floor.value == pytest.approx(sigma, rel=0.12)
    assert floor.low < sigma < floor.high


def test_a_change_that_is_even_from_repeat_to_repeat_is_no_noise() -> None:
    """The motion grows by a twentieth each time, which is 3000 times the noise."""
    rng = np.random.default_rng(3)
    period = multisine(2000, DT_S, band_hz=(1.0, 20.0), peak=2.0, rng=rng)
    motion = np.cumsum(period - period.mean())
    growing = np.concatenate([(1.0 + 0.05 * k) * motion for k in range(4)])
    sigma = 0.05 / 3000.0 * float(np.std(motion))
    noisy = growing + sigma * rng.standard_normal(growing.size)
    errors = np.concatenate(repeat_errors(record_of(np.tile(period, 4), noisy), "position_m"))
    # 3500 errors, which the second difference leaves correlated over whole periods only: their
    # deviation has a standard error of 1.2 % if independent, and twice that if they are pairs.
    assert np.std(errors) == pytest.approx(sigma, rel=0.1)


@pytest.mark.parametrize("count", [2, 4])
def test_repeats_elsewhere_in_the_stroke_are_not_compared(count: int) -> None:
    period = multisine(2000, DT_S, band_hz=(1.0, 20.0), peak=2.0, rng=np.random.default_rng(1))
    command = np.tile(period, count)
    position = np.cumsum(command) * 1e-6
    assert repeat_errors(record_of(command, position), "position_m")
    drifting = position + np.linspace(0.0, 10.0 * np.ptp(position), command.size)
    assert repeat_errors(record_of(command, drifting), "position_m") == []


@pytest.mark.parametrize("step", [0.0, 1e-5])
def test_rest_shows_coloured_noise(step: float) -> None:
    rng = np.random.default_rng(3)
    moving = multisine(4000, DT_S, band_hz=(0.5, 10.0), peak=2.0, rng=rng)
    command = np.concatenate([np.zeros(6000), moving, np.zeros(6000)])
    position = 0.1 + np.cumsum(command) * 1e-5
    sigma = 2e-5
    position = position + coloured(command.size, sigma, 30.0, 4)
    if step:
        position = step * np.round(position / step)
    record = record_of(command, position)
    windows = rest_windows(record)
    assert len(windows) >= 20
    assert all(np.ptp(command[window]) == 0.0 for window in windows)
    assert len(rest_errors(record, "position_m")) == len(windows)
    # The straight line over half a second removes frequencies below about 2 Hz. A first-order
    # spectrum of 30 Hz has 4 % of its power there.
    expected = np.hypot(sigma, step / np.sqrt(12.0))
    assert floor_of(record, "position_m").value == pytest.approx(expected, rel=0.1)


def test_spikes_at_rest_do_not_count() -> None:
    command = np.concatenate([np.zeros(20000), np.sin(np.arange(2000) * 0.01)])
    rng = np.random.default_rng(0)
    position = np.cumsum(command) * 1e-5 + 1e-6 * rng.standard_normal(command.size)
    position[5100] += 1e-3
    floor = floor_of(record_of(command, position), "position_m")
    assert floor.value == pytest.approx(1e-6, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("dt_s", "is_motion"), [(0.05, True), (1e-3, False), (1e-4, False)])
def test_motion_at_coarse_sampling_is_not_taken_for_noise(dt_s: float, is_motion: bool) -> None:
    time = np.arange(0.0, 60.0, dt_s)
    rng = np.random.default_rng(0)
    motion = 0.02 * (np.sin(2.0 * np.pi * 0.7 * time) + 0.3 * np.sin(2.0 * np.pi * 3.1 * time))
    moving = (time > 10.0) & (time < 50.0)
    sigma = 1e-6
    position = np.where(moving, motion, 0.0) + sigma * rng.standard_normal(time.size)
    command = np.where(moving, rng.standard_normal(time.size), 0.0)
    in_motion = position[moving]
    assert shows_motion(in_motion) == is_motion
    if is_motion:
        assert noise_floor(in_motion).value > 10.0 * sigma
    record = record_of(command, position, dt_s)
    # At rest there are 18 windows of at least ten samples less two: a standard error of 6 %, and
    # much less at 0.1 ms.
    assert floor_of(record, "position_m").value == pytest.approx(sigma, rel=0.2)
    # Without rest, the estimate from differences is an upper bound of the floor.
    floor = floor_of(record_of(command[moving], in_motion, dt_s), "position_m")
    assert floor.value == pytest.approx(noise_floor(in_motion).value)
    assert (floor.low < 0.1 * floor.value) == is_motion


@pytest.mark.slow
@given(step=st.floats(1e-7, 1e-2), seed=st.integers(0, 100), is_wide=st.booleans())
def test_the_step_of_a_sensor_does_not_depend_on_the_range(
    step: float, seed: int, is_wide: bool
) -> None:
    rng = np.random.default_rng(seed)
    range_m = 4000.0 if is_wide else 40.0
    signal = step * range_m * np.cumsum(rng.standard_normal(4000)) / 60.0
    quantised = step * np.round(signal / step)
    assert sensor_step(quantised) == pytest.approx(step, rel=1e-6)
    # A text file rounds the values.
    assert sensor_step(np.array([float(f"{value:.9g}") for value in quantised])) == pytest.approx(
        step, rel=1e-2
    )
    assert sensor_step(signal) == 0.0


def test_a_record_without_time_has_no_floor() -> None:
    with pytest.raises(ValueError, match="one stretch with a sampling time"):
        floor_of(make_record({"position_m": np.arange(300.0)}), "position_m")
