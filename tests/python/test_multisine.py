# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.excitation import multisine


@given(
    n=st.integers(16, 400),
    dt_s=st.floats(1e-4, 1.0),
    rms=st.floats(1e-3, 1e3),
    edges=st.tuples(st.floats(0.01, 0.99), st.floats(0.01, 0.99)),
    seed=st.integers(0, 2**32 - 1),
)
def test_equal_lines_inside_the_band_and_nothing_outside(
    n: int, dt_s: float, rms: float, edges: tuple[float, float], seed: int
) -> None:
    line = 1.0 / (n * dt_s)
    low, high = sorted(edge * 0.5 / dt_s for edge in edges)
    if low < line:
        low = line
    if high < low + line:
        high = low + line
    if high >= 0.5 / dt_s:
        return
    u = multisine(n, dt_s, band_hz=(low, high), rms=rms, rng=np.random.default_rng(seed))
    assert u.shape == (n,)
    # Rounding of an n-point transform: a few units in the last place times log2(n).
    assert np.sqrt(np.mean(u**2)) == pytest.approx(rms, rel=1e-13)
    spectrum = np.abs(np.fft.rfft(u))
    frequency = np.fft.rfftfreq(n, dt_s)
    edge = 1e-9 * line
    inside = (frequency >= low - edge) & (frequency <= high + edge)
    assert spectrum[~inside].max() <= 1e-12 * spectrum.max()
    assert np.ptp(spectrum[inside]) <= 1e-12 * spectrum.max()


def test_phases_are_drawn_from_the_generator() -> None:
    signals = [
        multisine(64, 0.1, band_hz=(0.2, 2.0), rms=1.0, rng=np.random.default_rng(seed))
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(signals[0], signals[1])
    assert np.max(np.abs(signals[0] - signals[2])) > 0.1


@pytest.mark.parametrize("band", [(0.0, 1.0), (2.0, 1.0), (1.0, 5.0), (-1.0, 1.0)])
def test_band_outside_the_limits_is_refused(band: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="half the sampling rate"):
        multisine(100, 0.1, band_hz=band, rms=1.0, rng=np.random.default_rng(0))


def test_band_between_two_lines_is_refused() -> None:
    with pytest.raises(ValueError, match=r"no multiple of .* = 0\.1 Hz"):
        multisine(100, 0.1, band_hz=(0.12, 0.18), rms=1.0, rng=np.random.default_rng(0))
