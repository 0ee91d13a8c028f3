# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.diagnosis import noise_floor


@given(seed=st.integers(0, 500), sigma=st.floats(1e-6, 1e3))
def test_the_floor_of_white_noise_on_motion_is_its_deviation(seed: int, sigma: float) -> None:
    rng = np.random.default_rng(seed)
    time = np.arange(8000) * 1e-3
    # Slow motion, and an oil spring of 70 Hz with five hundred times the noise. Third differences
    # would leave ten times the noise, seventh differences leave a thirtieth.
    motion = 2.0e3 * sigma * np.sin(2.0 * np.pi * 0.5 * time) + 500.0 * sigma * np.sin(440.0 * time)
    floor = noise_floor(motion + sigma * rng.standard_normal(time.size))
    # Medians of 400 strongly correlated differences scatter by about 8 %, the median of twenty
    # blocks by 2.5 %; the tolerance is four of these.
    assert floor.value == pytest.approx(sigma, rel=0.1)
    assert floor.low <= floor.value <= floor.high
    # The second and the nineteenth of twenty blocks are about 1.65 standard deviations from the
    # median, a ratio of about 1.3; the tolerance adds five times the scatter of the quantiles.
    assert floor.high < 1.8 * floor.low


def test_the_floor_of_a_quantised_signal_follows_from_its_step() -> None:
    time = np.arange(4000) * 1e-3
    step = 1e-4
    quantised = step * np.round(1e-2 * np.sin(2.0 * np.pi * 0.3 * time) / step)
    # A quantised signal that mostly stays constant has no noise in most differences.
    assert noise_floor(quantised).value == pytest.approx(step / np.sqrt(12.0), rel=0.05)


def test_floor_of_noise_that_grows_is_an_interval() -> None:
    rng = np.random.default_rng(0)
    sigma = np.repeat([1.0, 4.0], 4000)
    floor = noise_floor(sigma * rng.standard_normal(8000))
    assert floor.low == pytest.approx(1.0, rel=0.15)
    assert floor.high == pytest.approx(4.0, rel=0.15)


def test_short_signals_are_refused() -> None:
    with pytest.raises(ValueError, match="100 samples, there are 50"):
        noise_floor(np.zeros(50))
