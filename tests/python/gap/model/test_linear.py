# SPDX-License-Identifier: MIT
"""Products of updated slopes without the slopes, against the slopes written out."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.gap.model.linear import Linear


def explicit_update(
    slopes: np.ndarray, change: np.ndarray, step: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Broyden's update of slopes that are written out."""
    weights = scale * step / (step @ (scale * step))
    return np.asarray(slopes + np.outer(change - slopes @ step, weights))


@given(seed=st.integers(0, 200), updates=st.integers(0, 4))
def test_products_are_those_of_the_slopes_written_out(seed: int, updates: int) -> None:
    rng = np.random.default_rng(seed)
    errors, slopes = rng.standard_normal(30), rng.standard_normal((30, 5))
    linear = Linear({"y": errors}, {"y": slopes})
    for _ in range(updates):
        step, after = rng.standard_normal(5), rng.standard_normal(30)
        scale = rng.uniform(0.1, 10.0, 5)
        linear = linear.updated(step, {"y": after}, scale)
        slopes = explicit_update(slopes, after - errors, step, scale)
        errors = after
    gradient, gram = linear.products("y")
    # Rounding of 30 products grows with the updates, whose size is that of the slopes over a step.
    largest = float(np.max(np.abs(slopes)))
    np.testing.assert_allclose(linear.slopes["y"], slopes, atol=1e-11 * largest)
    np.testing.assert_allclose(gradient, slopes.T @ errors, atol=1e-10 * largest)
    np.testing.assert_allclose(gram, slopes.T @ slopes, atol=1e-10 * largest**2)


def test_an_update_leaves_the_point_before_it_as_it_was() -> None:
    rng = np.random.default_rng(1)
    before = Linear({"y": rng.standard_normal(8)}, {"y": rng.standard_normal((8, 3))})
    gradient, gram = before.products("y")
    slopes = np.array(before.slopes["y"])
    before.updated(rng.standard_normal(3), {"y": rng.standard_normal(8)}, np.ones(3))
    np.testing.assert_array_equal(before.slopes["y"], slopes)
    np.testing.assert_array_equal(before.products("y")[0], gradient)
    np.testing.assert_array_equal(before.products("y")[1], gram)


def test_joined_sensitivities_have_the_products_of_all() -> None:
    rng = np.random.default_rng(2)
    all_slopes, errors = rng.standard_normal((40, 6)), rng.standard_normal(40)
    first = Linear({"y": np.zeros(40)}, {"y": all_slopes[:, :4]})
    joined = first.joined({"y": errors}, {"y": all_slopes[:, 4:]})
    assert joined.size == 6
    np.testing.assert_array_equal(joined.slopes["y"], all_slopes)
    gradient, gram = joined.products("y")
    np.testing.assert_allclose(gradient, all_slopes.T @ errors, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(gram, all_slopes.T @ all_slopes, rtol=1e-12, atol=1e-12)
