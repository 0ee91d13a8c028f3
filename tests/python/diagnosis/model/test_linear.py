# SPDX-License-Identifier: MIT
"""Products of updated slopes without the slopes, against the slopes written out."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from made_spectra import spectrum_of

from ehsid.harness.diagnosis.model.linear import Linear
from ehsid.harness.diagnosis.model.spectrum import BANDS

# 2 windows of 13 samples and 3 of 5: 36 rows, in the first five of the bands.
SPECTRUM = spectrum_of((2, 13), (3, 5))
ROWS = 36


def explicit_update(
    slopes: np.ndarray, change: np.ndarray, step: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Broyden's update of slopes that are written out."""
    weights = scale * step / (step @ (scale * step))
    return np.asarray(slopes + np.outer(change - slopes @ step, weights))


@given(seed=st.integers(0, 200), updates=st.integers(0, 4))
def test_products_are_those_of_the_slopes_written_out(seed: int, updates: int) -> None:
    rng = np.random.default_rng(seed)
    errors, slopes = rng.standard_normal(ROWS), rng.standard_normal((ROWS, 5))
    by_band = rng.uniform(0.0, 1.0, BANDS)
    weights = np.diag(SPECTRUM.spread(by_band))
    linear = Linear(SPECTRUM, {"y": errors}, {"y": slopes})
    for _ in range(updates):
        step, after = rng.standard_normal(5), rng.standard_normal(ROWS)
        scale = rng.uniform(0.1, 10.0, 5)
        linear = linear.updated(step, {"y": after}, scale)
        slopes = explicit_update(slopes, after - errors, step, scale)
        errors = after
    gradient, gram = linear.products("y", by_band)
    # Rounding of 36 products grows with the updates, whose size is that of the slopes over a step.
    largest = float(np.max(np.abs(slopes)))
    np.testing.assert_allclose(linear.slopes["y"], slopes, atol=1e-11 * largest)
    np.testing.assert_allclose(gradient, slopes.T @ weights @ errors, atol=1e-10 * largest)
    np.testing.assert_allclose(gram, slopes.T @ weights @ slopes, atol=1e-10 * largest**2)


def test_a_gram_has_the_rows_of_its_band_only() -> None:
    slopes = np.random.default_rng(3).standard_normal((ROWS, 4))
    grams = Linear(SPECTRUM, {"y": np.zeros(ROWS)}, {"y": slopes}).gram("y")
    bands = SPECTRUM.spread(np.arange(BANDS, dtype=np.float64))
    assert grams.shape == (BANDS, 4, 4)
    for band in range(BANDS):
        rows = slopes[bands == band]
        np.testing.assert_allclose(grams[band], rows.T @ rows, rtol=1e-12, atol=1e-12)


def test_an_update_leaves_the_point_before_it_as_it_was() -> None:
    rng = np.random.default_rng(1)
    errors, slopes = rng.standard_normal(ROWS), rng.standard_normal((ROWS, 3))
    by_band = rng.uniform(0.0, 1.0, BANDS)
    before = Linear(SPECTRUM, {"y": errors}, {"y": slopes.copy()})
    gradient, gram = before.products("y", by_band)
    before.updated(rng.standard_normal(3), {"y": rng.standard_normal(ROWS)}, np.ones(3))
    np.testing.assert_array_equal(before.slopes["y"], slopes)
    np.testing.assert_array_equal(before.products("y", by_band)[0], gradient)
    np.testing.assert_array_equal(before.products("y", by_band)[1], gram)


def test_joined_sensitivities_have_the_products_of_all() -> None:
    rng = np.random.default_rng(2)
    all_slopes, errors = rng.standard_normal((ROWS, 6)), rng.standard_normal(ROWS)
    by_band = rng.uniform(0.0, 1.0, BANDS)
    weights = np.diag(SPECTRUM.spread(by_band))
    first = Linear(SPECTRUM, {"y": np.zeros(ROWS)}, {"y": all_slopes[:, :3]})
    joined = first.joined({"y": errors}, {"y": all_slopes[:, 3:5]})
    joined = joined.joined({"y": errors}, {"y": all_slopes[:, 5:]})
    assert joined.size == 6
    np.testing.assert_array_equal(joined.slopes["y"], all_slopes)
    gradient, gram = joined.products("y", by_band)
    expected = all_slopes.T @ weights
    np.testing.assert_allclose(gradient, expected @ errors, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(gram, expected @ all_slopes, rtol=1e-12, atol=1e-12)
