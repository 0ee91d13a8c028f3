# SPDX-License-Identifier: MIT
"""Smoothed derivatives are exact for parabolas, and linear equations survive the smoothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.fitness.motion import kernel


@given(
    dt_s=st.sampled_from([1e-4, 1e-3, 2e-2]),
    duration_s=st.sampled_from([0.01, 0.04, 0.3]),
    slope=st.floats(-10.0, 10.0),
    bend=st.floats(-10.0, 10.0),
)
def test_derivatives_of_parabolas(
    dt_s: float, duration_s: float, slope: float, bend: float
) -> None:
    smoothing = kernel(duration_s, dt_s)
    size = 3 * smoothing.phi.size
    time = dt_s * np.arange(size)
    signal = 0.2 + slope * time + 0.5 * bend * time**2
    middle = slice(smoothing.half, size - smoothing.half)
    # Rounding of the signal, divided by the step once or twice.
    rounding = 1e-13 * float(np.abs(signal).max())
    first = smoothing.smooth(signal, 1)
    assert first == pytest.approx(slope + bend * time[middle], abs=1e-9 + rounding / dt_s)
    second = smoothing.smooth(signal, 2)
    assert second == pytest.approx(bend, abs=1e-9 + 10.0 * rounding / dt_s**2)
