# SPDX-License-Identifier: MIT
import math

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.signals.excitation import (
    chirp,
    odd_multisine,
    prbs,
    random_steps,
    triangle,
)


def lines_of(signal: np.ndarray) -> np.ndarray:
    """Lines of the spectrum that are there, beyond rounding."""
    spectrum = np.abs(np.fft.rfft(signal))
    return np.flatnonzero(spectrum > 1e-10 * spectrum.max())


@pytest.mark.slow
@given(n=st.integers(100, 500), group=st.integers(2, 6), seed=st.integers(0, 1000))
def test_odd_multisine_has_its_lines_and_no_others(n: int, group: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = odd_multisine(n, 0.01, band_hz=(2.0, 40.0), rms=0.7, rng=rng, group=group)
    np.testing.assert_array_equal(lines_of(found.samples), found.excited)
    assert np.sqrt(np.mean(found.samples**2)) == pytest.approx(0.7, rel=1e-12)
    assert np.all(found.excited % 2 == 1)
    assert np.all(found.detection % 2 == 1)
    both = np.sort(np.concatenate([found.excited, found.detection]))
    assert np.all(np.diff(both) == 2)  # every odd line is one or the other
    assert found.detection.size == both.size // group


def test_detection_lines_show_a_nonlinearity_and_no_linear_plant() -> None:
    rng = np.random.default_rng(1)
    found = odd_multisine(2000, 1e-3, band_hz=(1.0, 50.0), rms=1.0, rng=rng)
    kernel = np.exp(-np.arange(2000) / 30.0)
    linear = np.fft.irfft(np.fft.rfft(found.samples) * np.fft.rfft(kernel), 2000)
    for signal, seen in ((linear, False), (linear + 0.01 * linear**3, True)):
        spectrum = np.abs(np.fft.rfft(signal))
        assert (spectrum[found.detection].max() > 1e-6 * spectrum.max()) == seen


@pytest.mark.parametrize("bits", [4, 7, 10])
def test_prbs_is_nearly_white_over_its_period(bits: int) -> None:
    period = 2**bits - 1
    signal = prbs(period, amplitude=2.0, hold=1, bits=bits)
    assert set(np.abs(signal)) == {2.0}
    correlation = np.fft.irfft(np.abs(np.fft.rfft(signal)) ** 2, period) / period
    # Golomb: one at zero, -1 / period everywhere else, times the square of the amplitude.
    assert correlation[0] == pytest.approx(4.0)
    np.testing.assert_allclose(correlation[1:], -4.0 / period, atol=1e-12)


def test_prbs_holds_and_repeats() -> None:
    signal = prbs(3 * 15 * 5, amplitude=1.0, hold=5, bits=4)
    runs = np.diff(np.flatnonzero(np.diff(signal) != 0.0))
    assert np.all(runs % 5 == 0)
    np.testing.assert_array_equal(signal[:75], signal[75:150])


@given(n=st.integers(1, 500), fewest=st.integers(1, 20), more=st.integers(0, 20))
def test_steps_keep_their_times_and_limits(n: int, fewest: int, more: int) -> None:
    rng = np.random.default_rng(n)
    signal = random_steps(n, amplitude=3.0, hold=(fewest, fewest + more), rng=rng)
    assert signal.shape == (n,)
    assert np.abs(signal).max() <= 3.0
    runs = np.diff(np.concatenate([[-1], np.flatnonzero(np.diff(signal) != 0.0)]))
    assert np.all((runs >= fewest) & (runs <= fewest + more))


def runs_of(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and lengths of stretches of equal samples."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(signal)) + 1])
    return signal[starts], np.diff(np.append(starts, signal.size))


@given(
    levels=st.integers(2, 9),
    fewest=st.integers(1, 20),
    more=st.integers(0, 20),
    amplitude=st.floats(1e-3, 1e3),
    seed=st.integers(0, 1000),
)
def test_levelled_steps_always_step_to_another_level(
    levels: int, fewest: int, more: int, amplitude: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    hold = (fewest, fewest + more)
    signal = random_steps(1000, amplitude=amplitude, hold=hold, rng=rng, levels=levels)
    # Each level differs from the one before, so that the runs are the holds, whole but the last.
    values, lengths = runs_of(signal)
    assert np.all(lengths[:-1] >= fewest)
    assert np.all(lengths <= fewest + more)
    places = (values + amplitude) * (levels - 1) / (2.0 * amplitude)
    np.testing.assert_allclose(places, np.round(places), atol=1e-12)
    assert places.min() > -0.5
    assert places.max() < levels - 0.5
    assert np.abs(signal).max() <= amplitude


def test_levels_and_holds_are_equally_likely() -> None:
    rng = np.random.default_rng(5)
    signal = random_steps(50_000, amplitude=2.0, hold=(3, 7), rng=rng, levels=4)
    values, lengths = runs_of(signal)
    moves = np.unique(np.stack([values[:-1], values[1:]]), axis=1, return_counts=True)[1]
    assert moves.size == 12  # from each of four levels to each other one
    for counts in (moves, np.unique(lengths[:-1], return_counts=True)[1]):
        # Of fair draws one in a thousand fails, of this seed none.
        assert scipy.stats.chisquare(counts).pvalue > 1e-3


def test_steps_of_any_level_fill_the_interval_evenly() -> None:
    rng = np.random.default_rng(6)
    values = random_steps(5000, amplitude=2.0, hold=(1, 1), rng=rng)
    assert scipy.stats.kstest(values, scipy.stats.uniform(-2.0, 4.0).cdf).pvalue > 1e-3


def test_triangle_goes_in_straight_lines_through_its_corners() -> None:
    signal = triangle(401, 0.01, amplitude=2.0, period_s=2.0)
    for second, value in ((0.0, 0.0), (0.5, 2.0), (1.0, 0.0), (1.5, -2.0), (2.0, 0.0), (4.0, 0.0)):
        assert signal[round(second / 0.01)] == pytest.approx(value, abs=1e-9)
    # 2 in half a second, up or down, everywhere.
    np.testing.assert_allclose(np.abs(np.diff(signal)), 0.04, atol=1e-9)


@given(dt_s=st.floats(1e-4, 1.0), samples=st.floats(4.0, 300.0), reversals=st.integers(1, 40))
def test_triangle_reverses_once_in_each_half_period(
    dt_s: float, samples: float, reversals: int
) -> None:
    period_s = samples * dt_s
    if period_s < 4.0 * dt_s:  # by rounding
        return
    n = math.ceil(0.5 * reversals * samples * (1.0 - 1e-12)) + 1  # to the last zero, or just past
    signal = triangle(n, dt_s, amplitude=3.0, period_s=period_s)
    # Two samples beside a corner may be equal, or differ by rounding.
    slopes = np.diff(signal)
    slopes = np.sign(slopes[np.abs(slopes) > 1e-9])
    assert np.count_nonzero(np.diff(slopes)) == reversals
    # At most one sample's slope from zero.
    assert abs(signal[-1]) <= 4.0 * 3.0 / samples * (1.0 + 1e-9) + 1e-9


def test_chirp_crosses_zero_as_often_as_its_frequency_says() -> None:
    n, dt_s, low, high = 20000, 1e-3, 0.5, 20.0
    signal = chirp(n, dt_s, amplitude=1.5, band_hz=(low, high))
    assert np.abs(signal).max() <= 1.5
    assert abs(signal[0]) < 1e-12
    time = (n - 1) * dt_s
    # Phase of a frequency that grows by equal factors: T (f1 - f0) / ln(f1 / f0) periods.
    periods = time * (high - low) / np.log(high / low)
    crossings = np.count_nonzero(np.diff(np.sign(signal[1:])) != 0.0)
    assert abs(crossings - 2.0 * periods) <= 1.0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: prbs(10, amplitude=-1.0, hold=1), "prbs: .* amplitude = -1"),
        (lambda: prbs(10, amplitude=1.0, hold=0), "hold >= 1"),
        (lambda: prbs(10, amplitude=1.0, hold=1, bits=40), "bits 2 to 20"),
        (lambda: triangle(10, 0.1, amplitude=1.0, period_s=0.3), "period_s >= 0.4"),
        (lambda: chirp(10, 0.1, amplitude=1.0, band_hz=(1.0, 6.0)), "0 < low < high < 5"),
        (lambda: chirp(10, np.nan, amplitude=1.0, band_hz=(1.0, 6.0)), "dt_s = nan"),
        (
            lambda: random_steps(
                9, amplitude=1.0, hold=(1, 2), rng=np.random.default_rng(0), levels=1
            ),
            "levels = 1: expected levels >= 2",
        ),
        (
            lambda: random_steps(9, amplitude=1.0, hold=(3, 2), rng=np.random.default_rng(0)),
            "fewest <= most",
        ),
        (
            lambda: odd_multisine(
                100, 0.01, band_hz=(1.0, 3.0), rms=1.0, rng=np.random.default_rng(0)
            ),
            "odd lines in the band",
        ),
    ],
)
def test_arguments_outside_their_ranges_are_named(call: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        call()  # type: ignore[operator]
