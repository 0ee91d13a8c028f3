# SPDX-License-Identifier: MIT
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.signals.excitation import multisine, odd_multisine


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


def spectrum_is_flat(signal: np.ndarray) -> bool:
    """Whether all lines that are there are of one height, to a hundred times rounding."""
    spectrum = np.abs(np.fft.rfft(signal))
    lines = spectrum[spectrum > 1e-6 * spectrum.max()]
    return bool(np.ptp(lines) < 1e-12 * spectrum.max())


@given(peak=st.floats(1e-3, 1e3), seed=st.integers(0, 2**32 - 1))
def test_peak_alone_is_reached_and_not_passed(peak: float, seed: int) -> None:
    draws = [np.random.default_rng(seed) for _ in range(2)]
    for signal in (
        multisine(200, 0.01, band_hz=(1.0, 30.0), peak=peak, rng=draws[0]),
        odd_multisine(200, 0.01, band_hz=(1.0, 30.0), peak=peak, rng=draws[1]).samples,
    ):
        assert np.abs(signal).max() <= peak
        # One product and one quotient, each rounded.
        assert np.abs(signal).max() >= peak * (1.0 - 4.0 * np.finfo(float).eps)
        assert spectrum_is_flat(signal)  # scaled, not clipped


@given(rms=st.floats(0.01, 10.0), crest=st.floats(1.0, 6.0), seed=st.integers(0, 2**32 - 1))
def test_rms_is_kept_under_the_peak_or_refused_with_what_would_fit(
    rms: float, crest: float, seed: int
) -> None:
    def draw(rms: float, peak: float) -> np.ndarray:
        rng = np.random.default_rng(seed)
        return multisine(200, 0.01, band_hz=(1.0, 30.0), rms=rms, peak=peak, rng=rng)

    rng = np.random.default_rng(seed)
    free = multisine(200, 0.01, band_hz=(1.0, 30.0), rms=rms, rng=rng)
    peak = crest * rms
    if np.abs(free).max() <= peak:
        np.testing.assert_array_equal(draw(rms, peak), free)
        return
    with pytest.raises(ValueError, match="multisine: rms = ") as refused:
        draw(rms, peak)
    found = re.search(r"an rms of (\S+), this rms needs a peak of (\S+);", str(refused.value))
    assert found is not None
    smaller_rms, larger_peak = map(float, found.groups())
    assert np.abs(draw(smaller_rms, peak)).max() <= peak
    assert np.sqrt(np.mean(draw(rms, larger_peak) ** 2)) == pytest.approx(rms, rel=1e-13)
    # No more is given away than rounding to four digits asks for: 1.5 thousandths at most.
    for values in ((1.0016 * smaller_rms, peak), (rms, larger_peak / 1.0016)):
        with pytest.raises(ValueError, match="multisine: rms = "):
            draw(*values)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({}, "neither rms nor peak is given"),
        ({"rms": 0.0}, "rms = 0: expected a finite rms > 0"),
        ({"rms": np.nan}, "rms = nan"),
        ({"rms": 1.0, "peak": -3.0}, "peak = -3"),
        ({"peak": np.inf}, "peak = inf"),
    ],
)
def test_sizes_outside_their_ranges_are_named(sizes: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        multisine(200, 0.01, band_hz=(1.0, 30.0), rng=np.random.default_rng(0), **sizes)
