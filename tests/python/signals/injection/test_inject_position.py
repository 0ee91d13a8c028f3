# SPDX-License-Identifier: MIT
"""Effects of the sensor on a logged position against the simulator's and against scipy."""

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import lsim
from sources import ROOT

from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.injection.effects import behind_bias, behind_sensor
from ehsid.harness.signals.simulation import simulate

FloatArray = npt.NDArray[np.float64]
RIGS = ROOT / "examples" / "rigs"
DT_S = 1e-3


def position(**effects: float) -> FloatArray:
    """Of an axis that swings, with effects of its sensor, 2 s."""
    time_s = np.arange(2000) * DT_S
    command = 3.0 * np.sin(2.0 * np.pi * 2.0 * time_s) + 1.5 * np.sin(2.0 * np.pi * 7.3 * time_s)
    rig = read_rig(RIGS / "axis.toml").with_values(
        {f"effects.{name.replace('__', '.')}": value for name, value in effects.items()}
    )
    return simulate(rig, command, dt_s=DT_S).record.column("position_m")


@pytest.fixture(scope="module")
def plain() -> FloatArray:
    return position()


@pytest.fixture(scope="module")
def bend(plain: FloatArray) -> float:
    """What the position does between samples beyond a straight line: the second difference."""
    return float(np.abs(np.diff(plain, 2)).max())


def test_play_is_that_of_the_simulator(plain: FloatArray, bend: float) -> None:
    found = behind_sensor(plain, "sensor_backlash", {"half_width_m": 5e-4}, DT_S).signal
    np.testing.assert_allclose(
        found, position(sensor_backlash__half_width_m=5e-4), rtol=0.0, atol=bend
    )
    assert np.abs(found - plain).max() > 4e-4


def test_lag_is_that_of_the_simulator_and_of_scipy(plain: FloatArray, bend: float) -> None:
    found = behind_sensor(plain, "sensor_lag", {"time_constant_s": 0.008}, DT_S).signal
    np.testing.assert_allclose(
        found, position(sensor_lag__time_constant_s=0.008), rtol=0.0, atol=bend
    )
    _, shown, _ = lsim(
        ([1.0], [0.008, 1.0]), plain - plain[0], np.arange(plain.size) * DT_S, interp=True
    )
    np.testing.assert_allclose(found, plain[0] + shown, rtol=0.0, atol=1e-12)


def test_steps_are_those_of_the_simulator(plain: FloatArray) -> None:
    found = behind_sensor(plain, "sensor_quantisation", {"step_m": 2e-4}, DT_S).signal
    np.testing.assert_allclose(
        found, position(sensor_quantisation__step_m=2e-4), rtol=0.0, atol=1e-15
    )
    assert np.unique(np.round(found / 2e-4)).size > 20


def test_halves_are_rounded_away_from_zero() -> None:
    halves = np.array([-1.5, -0.5, 0.5, 1.5, 2.5])
    np.testing.assert_array_equal(
        behind_sensor(halves, "sensor_quantisation", {"step_m": 1.0}, DT_S).signal,
        [-2.0, -1.0, 1.0, 2.0, 3.0],
    )


def test_bias_moves_all() -> None:
    np.testing.assert_array_equal(behind_bias(np.array([0.5, 0.25]), 0.25).signal, [0.75, 0.5])
