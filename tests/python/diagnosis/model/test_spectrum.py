# SPDX-License-Identifier: MIT
"""The transform of the errors in windows, against matrices written out."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_spectra import spectrum_of
from scipy.fft import dct
from scipy.linalg import toeplitz

from ehsid.harness.diagnosis.model.comparison import compare
from ehsid.harness.diagnosis.model.spectrum import BANDS, Spectrum
from ehsid.harness.diagnosis.schema import SKIP_S, WINDOW_S
from ehsid.harness.records import make_record

# Number of coefficients that are kept: all but the last one in windows that are no longer.
KEPT = 1 << (BANDS - 1)
# Windows and samples of a few records. The last ones have more samples than coefficients.
SHAPES = st.lists(
    st.tuples(st.integers(1, 4), st.one_of(st.integers(2, 40), st.integers(250, 300))),
    min_size=1,
    max_size=3,
)


def matrix(length: int) -> np.ndarray:
    """The formula of the module, written out: row k gives coefficient k, shape (N, N)."""
    k, t = np.mgrid[:length, :length]
    rows = np.sqrt(2.0 / length) * np.cos(np.pi * k * (t + 0.5) / length)
    rows[0] = 1.0 / np.sqrt(length)
    return np.asarray(rows)


def kept(length: int) -> int:
    """Number of coefficients that are kept of a window: there is one difference less."""
    return min(length - 1, KEPT)


def band_of(coefficient: int) -> int:
    """Number of the band of a coefficient: 0 | 1 | 2, 3 | 4 ... 7 | and so on."""
    return 0 if coefficient == 0 else 1 + int(np.floor(np.log2(coefficient)))


def draw_errors(seed: int, shapes: list[tuple[int, int]]) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.standard_normal(windows * length) for windows, length in shapes]


@given(seed=st.integers(0, 1000), shapes=SHAPES)
def test_coefficients_are_those_of_the_formula(seed: int, shapes: list[tuple[int, int]]) -> None:
    errors = draw_errors(seed, shapes)
    found = spectrum_of(*shapes).transform(errors, differences=False)
    expected = []
    for (windows, length), rows in zip(shapes, errors, strict=True):
        by_window = rows.reshape(windows, length) @ matrix(length).T
        # First coefficient 0 of each window, then coefficient 1 of each, up to the last one kept.
        expected.append(by_window[:, : kept(length)].T.ravel())
    # Sums of up to 300 products near 1, each with a rounding error of 1e-16.
    np.testing.assert_allclose(found, np.concatenate(expected), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("length", [17, 34, 249, 499])
def test_lengths_with_a_large_prime_factor_have_the_same_coefficients(length: int) -> None:
    """They are not transformed by a fast algorithm."""
    (errors,) = draw_errors(2, [(3, length)])
    expected = dct(errors.reshape(3, length), type=2, norm="ortho", axis=1)[:, : kept(length)]
    found = spectrum_of((3, length)).transform([errors], differences=False)
    np.testing.assert_allclose(found, expected.T.ravel(), rtol=0.0, atol=1e-12)


@given(seed=st.integers(0, 1000), windows=st.integers(1, 5), length=st.integers(2, KEPT))
def test_the_transform_keeps_the_energy(seed: int, windows: int, length: int) -> None:
    (errors,) = draw_errors(seed, [(windows, length)])
    coefficients = spectrum_of((windows, length)).transform([errors], differences=False)
    last = errors.reshape(windows, length) @ matrix(length)[-1]
    energy = coefficients @ coefficients + last @ last
    assert energy == pytest.approx(errors @ errors, rel=1e-12)
    steps = np.diff(errors.reshape(windows, length), axis=1)
    coefficients = spectrum_of((windows, length)).transform([errors], differences=True)
    assert coefficients @ coefficients == pytest.approx(np.sum(steps**2), rel=1e-12)


def test_columns_are_transformed_one_by_one() -> None:
    rng = np.random.default_rng(3)
    shapes = [(3, 20), (2, 260)]
    spectrum = spectrum_of(*shapes)
    slopes = [rng.standard_normal((windows * length, 4)) for windows, length in shapes]
    together = spectrum.transform(slopes, differences=True)
    for column in range(4):
        alone = spectrum.transform([rows[:, column] for rows in slopes], differences=True)
        # Products of one and of four columns may add up in another order.
        np.testing.assert_allclose(together[:, column], alone, rtol=0.0, atol=1e-12)


@given(seed=st.integers(0, 1000), shapes=SHAPES, drift=st.floats(-1e3, 1e3))
def test_a_centred_error_is_known_up_to_a_constant_in_each_window(
    seed: int, shapes: list[tuple[int, int]], drift: float
) -> None:
    errors = draw_errors(seed, shapes)
    spectrum = spectrum_of(*shapes)
    shifted = [
        rows + drift * np.repeat(np.arange(windows), length)
        for rows, (windows, length) in zip(errors, shapes, strict=True)
    ]
    before, after = (spectrum.transform(each, differences=True) for each in (errors, shifted))
    # Rounding of a constant of up to 3e3 in a sum of 300 samples.
    np.testing.assert_allclose(after, before, rtol=0.0, atol=1e-8)


@given(seed=st.integers(0, 1000), shapes=SHAPES, drift=st.floats(-1e3, 1e3))
def test_a_steady_drift_is_in_the_first_coefficient_of_differences_only(
    seed: int, shapes: list[tuple[int, int]], drift: float
) -> None:
    errors = draw_errors(seed, shapes)
    spectrum = spectrum_of(*shapes)
    drifting = [
        rows + drift * np.tile(np.arange(length), windows)
        for rows, (windows, length) in zip(errors, shapes, strict=True)
    ]
    before, after = (spectrum.transform(each, differences=True) for each in (errors, drifting))
    for rows in itertools.chain.from_iterable(spectrum.bands[1:]):
        # Rounding of a ramp of up to 3e5 in a sum of 300 differences.
        np.testing.assert_allclose(after[rows], before[rows], rtol=0.0, atol=1e-6)


@pytest.mark.slow
@given(shapes=SHAPES)
def test_a_band_is_an_octave(shapes: list[tuple[int, int]]) -> None:
    """Errors that are one coefficient have their power in its band, in no other."""
    spectrum = spectrum_of(*shapes)
    longest = max(length for _, length in shapes)
    for coefficient in {0, 1, 2, 3, 4, 7, 8, 15, 16, 127, 128, KEPT - 1}:
        if coefficient >= kept(longest):
            continue
        errors = [
            np.tile(matrix(length)[coefficient], windows)
            if coefficient < kept(length)
            else np.zeros(windows * length)
            for windows, length in shapes
        ]
        powers = spectrum.powers(spectrum.transform(errors, differences=False))
        others = np.arange(BANDS) != band_of(coefficient)
        assert powers[~others] > 0.0
        # Rounding of sums of 300 products, squared.
        assert np.max(powers[others]) < 1e-24


@given(shapes=SHAPES)
def test_every_row_is_in_one_band(shapes: list[tuple[int, int]]) -> None:
    spectrum = spectrum_of(*shapes)
    rows = np.concatenate([np.arange(s.start, s.stop) for band in spectrum.bands for s in band])
    total = sum(windows * kept(length) for windows, length in shapes)
    np.testing.assert_array_equal(np.sort(rows), np.arange(total))
    assert spectrum.windows == sum(windows for windows, _ in shapes)
    expected = np.zeros(BANDS)
    for windows, length in shapes:
        for coefficient in range(kept(length)):
            expected[band_of(coefficient)] += windows
    np.testing.assert_array_equal(spectrum.sizes, expected)


@pytest.mark.parametrize("differences", [False, True])
def test_white_noise_has_the_variance_of_its_gain_in_each_band(differences: bool) -> None:
    deviation, shapes = 3.0, [(400, 250), (300, 300)]
    rng = np.random.default_rng(7)
    errors = [deviation * rng.standard_normal(windows * length) for windows, length in shapes]
    spectrum = spectrum_of(*shapes)
    powers = spectrum.powers(spectrum.transform(errors, differences=differences))
    gain = spectrum.noise_gain(differences=differences)
    # Differences of white noise have the variance 4 sin(pi k / (2 N))^2, nearly; exactly the sum of
    # all is 2 for each difference. Neighbouring coefficients are hardly correlated.
    # The mean of n squares scatters by sqrt(2 / n) of itself; five deviations in each of 9 bands.
    scatter = 5.0 * np.sqrt(2.0 / spectrum.sizes)
    np.testing.assert_array_less(np.abs(powers / (deviation**2 * gain) - 1.0), scatter)


@pytest.mark.slow
@given(length=st.integers(3, 300))
def test_the_gain_of_white_noise_is_the_exact_covariance(length: int) -> None:
    spectrum = spectrum_of((2, length))
    steps = np.diff(np.eye(length), axis=0)
    covariance = matrix(length - 1) @ steps @ steps.T @ matrix(length - 1).T
    expected = np.ones(BANDS)
    for band in range(BANDS):
        numbers = [k for k in range(kept(length)) if band_of(k) == band]
        if numbers:
            expected[band] = np.mean(np.diag(covariance)[numbers])
    np.testing.assert_allclose(spectrum.noise_gain(differences=True), expected, rtol=1e-9)
    np.testing.assert_array_equal(spectrum.noise_gain(differences=False), 1.0)


def test_an_empty_band_has_no_power() -> None:
    spectrum = spectrum_of((3, 5))
    powers = spectrum.powers(spectrum.transform([np.ones(15)], differences=False))
    np.testing.assert_array_equal(spectrum.sizes, [3, 3, 6, 0, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(powers[3:], 0.0)


def correlations(covariance: np.ndarray) -> np.ndarray:
    """The correlations between different variables of a covariance."""
    scale = np.sqrt(np.diag(covariance))
    return np.asarray((covariance / np.outer(scale, scale))[~np.eye(len(scale), dtype=bool)])


@given(pole=st.floats(0.0, 0.99))
def test_the_coefficients_of_a_coloured_disturbance_are_nearly_independent(pole: float) -> None:
    """A first-order disturbance has the covariance pole^|i - j|, which is transformed exactly."""
    length = 128
    covariance = toeplitz(pole ** np.arange(length))
    transformed = matrix(length) @ covariance @ matrix(length).T
    samples, coefficients = correlations(covariance), correlations(transformed)
    # Both have the same number of correlations. A disturbance of the pole 0.99 still has some of
    # 0.3 between the lowest coefficients, where the samples have 0.99; all together are far less.
    assert np.sum(coefficients**2) <= 0.1 * np.sum(samples**2) + 1e-20
    assert np.sqrt(np.mean(coefficients**2)) < 0.02


@given(seed=st.integers(0, 1000), shapes=SHAPES)
def test_sums_by_window_and_repeats_by_row_belong_together(
    seed: int, shapes: list[tuple[int, int]]
) -> None:
    spectrum = spectrum_of(*shapes)
    rng = np.random.default_rng(seed)
    rows, by_band = rng.uniform(size=int(spectrum.sizes.sum())), rng.uniform(size=BANDS)
    sums, windows = spectrum.by_window(rows), spectrum.window_of_rows()
    assert sums.shape == (spectrum.windows, BANDS)
    spread = spectrum.spread(by_band)
    # The rows of each band, picked by its number.
    bands = spectrum.spread(np.arange(BANDS, dtype=np.float64)).astype(int)
    np.testing.assert_array_equal(spread, by_band[bands])
    expected = np.zeros_like(sums)
    np.add.at(expected, (windows, bands), rows)
    np.testing.assert_allclose(sums, expected, rtol=1e-12)
    # Means over the rows of a band are those over its windows.
    means = sums.sum(axis=0) / np.maximum(spectrum.sizes, 1.0)
    np.testing.assert_allclose(means, spectrum.powers(np.sqrt(rows)), rtol=1e-12)


def test_each_row_belongs_to_the_window_of_its_error() -> None:
    """An error in one window alone has coefficients in the rows of that window alone."""
    shapes = [(3, 20), (2, 30)]
    spectrum = spectrum_of(*shapes)
    number = 0
    for record, (windows, length) in enumerate(shapes):
        for window in range(windows):
            errors = [np.zeros(w * n) for w, n in shapes]
            errors[record][window * length] = 1.0
            hit = spectrum.transform(errors, differences=False) != 0.0
            assert set(spectrum.window_of_rows()[hit]) == {number}
            number += 1


def test_a_short_window_at_the_end_of_a_record_is_left_out() -> None:
    dt_s, rng = 2e-3, np.random.default_rng(9)
    records = []
    for seconds in (2.2, 1.8):  # four windows of half a second and 0.2 s, three and 0.3 s
        time = np.arange(round((seconds + SKIP_S) / dt_s)) * dt_s
        columns = {
            "command_v": rng.normal(size=time.size),
            "position_m": rng.normal(size=time.size),
        }
        records.append(compare(make_record({"time_s": time, **columns})))
    length = round(WINDOW_S / dt_s)
    assert [record.full_windows for record in records] == [(4, length), (3, length)]
    spectrum = Spectrum(records)
    inside = [record.inside(record.outputs["position_m"]) for record in records]
    assert [rows.size for rows in inside] == [1100, 900]
    found = spectrum.transform(inside, differences=False)
    assert found.size == 7 * kept(length)
    blocks = [inside[0][:1000].reshape(4, length), inside[1][:750].reshape(3, length)]
    expected = [
        dct(block, type=2, norm="ortho", axis=1)[:, : kept(length)].T.ravel() for block in blocks
    ]
    np.testing.assert_allclose(found, np.concatenate(expected), rtol=1e-12, atol=1e-12)
