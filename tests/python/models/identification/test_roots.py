# SPDX-License-Identifier: MIT
"""Poles and zeros: against control, by Monte Carlo, and tests of stability and common roots."""

from __future__ import annotations

import cmath
import math

import control
import numpy as np
import pytest
import scipy.stats
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from identification_truth import A16, B16, model16

from ehsid.harness.models.identification import (
    ArxModel,
    ArxOrders,
    IoData,
    fit_arx,
    nearest_cancellation,
    poles_zeros,
    stability_distance,
)

FloatArray = np.ndarray


def model(a: FloatArray, b: FloatArray, nk: int = 1, covariance: FloatArray | None = None):
    theta = np.concatenate((a, b)).astype(float)
    if covariance is None:
        covariance = 1e-6 * np.eye(theta.size)
    return ArxModel(ArxOrders(len(a), len(b), nk), theta, covariance, 1.0, 1.0, 500)


def fitted(seed: int, n: int = 1000, noise: float = 0.1) -> ArxModel:
    u, y = model16(seed=seed, n=n, noise=noise)
    return fit_arx(IoData.from_arrays(u, y), ArxOrders(3, 3, 1))


# Without numbers so small that their products underflow.
COEFFICIENTS = st.floats(-2, 2).map(lambda x: round(x, 6))


@pytest.mark.slow
@given(
    a=st.lists(COEFFICIENTS, min_size=1, max_size=5),
    b=st.lists(COEFFICIENTS, min_size=1, max_size=5),
    nk=st.integers(0, 4),
)
def test_poles_and_zeros_are_those_of_control(a: list[float], b: list[float], nk: int) -> None:
    assume(abs(b[0]) > 0.01)
    found = poles_zeros(model(np.array(a), np.array(b), nk))
    n = max(len(a), nk + len(b) - 1)
    numerator = np.concatenate((np.zeros(nk), b, np.zeros(n - nk - len(b) + 1)))
    denominator = np.concatenate(([1.0], a, np.zeros(n - len(a))))
    system = control.tf(numerator, denominator, 0.05)
    for ours, at_origin, theirs in (
        (found.poles, found.origin_poles, system.poles()),
        (found.zeros, found.origin_zeros, system.zeros()),
    ):
        mine = np.concatenate((ours.values, np.zeros(at_origin)))
        assert mine.size == theirs.size
        # As polynomials: single roots of nearly double ones differ by the root of the rounding.
        scale = np.abs(np.poly(theirs)).max()
        np.testing.assert_allclose(np.poly(mine), np.poly(theirs), atol=1e-8 * scale)


@pytest.mark.slow
def test_covariances_are_those_of_many_draws() -> None:
    """Parameters drawn from their distribution, roots found anew by numpy."""
    one = fitted(1, noise=0.01)
    found = poles_zeros(one)
    draws = np.random.default_rng(2).multivariate_normal(one.theta, one.covariance, size=4000)
    for roots, leading, columns in (
        (found.poles, None, slice(0, 3)),
        (found.zeros, "b", slice(3, 6)),
    ):
        assert roots.reliable.all()
        sample = []
        for theta in draws[:, columns]:
            values = np.roots(theta if leading else np.concatenate(([1.0], theta)))
            sample.append([values[np.argmin(np.abs(values - root))] for root in roots.values])
        scatter = np.array(sample)
        for i in range(roots.values.size):
            parts = np.column_stack((scatter[:, i].real, scatter[:, i].imag))
            # A variance of 4000 draws is known to sqrt(2 / 4000) = 2.2 %: 4 sigma and 5 % for what
            # the delta method leaves out.
            for j in range(2):
                expected = roots.covariance[i, j, j]
                assert np.var(parts[:, j]) == pytest.approx(expected, rel=0.14, abs=1e-14)
            assert np.std(np.abs(scatter[:, i])) == pytest.approx(
                roots.modulus_deviation[i], rel=0.07
            )


def test_a_double_root_is_said_to_be_unreliable() -> None:
    near = poles_zeros(model(np.poly([0.9, 0.9])[1:], np.array([1.0, 0.5])))
    assert not near.poles.reliable.any()
    clear = poles_zeros(model(np.poly([0.9, 0.5])[1:], np.array([1.0, 0.5])))
    assert clear.poles.reliable.all()
    # dr/da_i at 0.9: -(r, 1) / (0.9 - 0.5), deviations 1e-3 each.
    assert np.sqrt(clear.poles.covariance[0, 0, 0]) == pytest.approx(
        1e-3 * np.hypot(0.9, 1.0) / 0.4, rel=1e-9
    )


@pytest.mark.slow
def test_distance_to_the_border_of_a_first_order_model() -> None:
    """A single pole p is |1 - p| / sigma away, or |1 + p| / sigma."""
    for p in (0.98, 1.02, -0.97, 0.2):
        one = model(np.array([-p]), np.array([1.0]), covariance=np.diag([1e-4, 1e-4]))
        assert stability_distance(one) == pytest.approx((1.0 - abs(p) if p < 1 else p - 1.0) / 1e-2)


@pytest.mark.thorough
def test_distance_to_the_border_by_search() -> None:
    """No stable polynomial is nearer than told: among many draws around, in units of sigma."""
    a = np.poly([1.03 * np.exp(0.5j), 1.03 * np.exp(-0.5j), 0.6]).real[1:]
    root = np.random.default_rng(3).normal(size=(3, 3)) * 3e-3
    cov = np.eye(5) * 1e-6
    cov[:3, :3] += root @ root.T
    distance = stability_distance(model(a, np.array([1.0, 0.5]), covariance=cov))
    rng = np.random.default_rng(4)
    whitened = rng.normal(size=(40000, 3))
    whitened *= (rng.uniform(0, 4 * distance, 40000) / np.linalg.norm(whitened, axis=1))[:, None]
    draws = a + whitened @ np.linalg.cholesky(cov[:3, :3]).T
    stable = np.array([np.abs(np.roots(np.r_[1.0, d])).max() < 1.0 for d in draws])
    nearest = np.linalg.norm(whitened[stable], axis=1).min()
    # The draws come near the border, not onto it: one in a few hundred in a cone of 10 degrees.
    assert distance <= nearest < 1.2 * distance


def test_a_common_root_is_ruled_out_where_there_is_none() -> None:
    found = nearest_cancellation(fitted(5, noise=0.01))
    assert found is not None
    assert found.p_value < 1e-6
    assert nearest_cancellation(model(np.array([-0.9]), np.array([1.0]))) is None


@pytest.mark.thorough
def test_p_values_of_a_true_common_root_are_at_least_uniform() -> None:
    """Model (16) fitted with one order too many has a common root anywhere: p falls below 5 % in
    at most about 5 % of the records (the least over all places can only be smaller)."""
    p_values = []
    for seed in range(100):
        u, y = model16(seed=seed, n=600, noise=0.1)
        found = nearest_cancellation(fit_arx(IoData.from_arrays(u, y), ArxOrders(4, 4, 1)))
        assert found is not None
        p_values.append(found.p_value)
    rejected = int(np.sum(np.array(p_values) < 0.05))
    # More than this once in a thousand.
    assert rejected <= scipy.stats.binom.isf(1e-3, 100, 0.05)


@pytest.mark.slow
@settings(max_examples=10)
@given(radius=st.floats(0.2, 0.95), turn=st.floats(0.0, 1.0), gap=st.floats(0.3, 1.0))
def test_a_planted_common_root_is_found(radius: float, turn: float, gap: float) -> None:
    # Above the real axis by 0.05 at least.
    least = math.asin(0.05 / radius)
    place = cmath.rect(radius, least + turn * (math.pi - 2.0 * least))
    pair = [place, place.conjugate()]
    a = np.poly([*pair, 0.99]).real[1:]
    b = np.poly(pair).real * 0.7
    found = nearest_cancellation(model(a, b))
    assert found is not None
    assert found.p_value > 0.99
    assert abs(found.place - place) < 1e-2
    # Moved apart by far more than the uncertainty of 1e-3, it is none.
    moved = np.poly([p * (1.0 - gap) for p in pair]).real * 0.7
    apart = nearest_cancellation(model(a, moved))
    assert apart is not None
    assert apart.p_value < 0.05


def test_model_16_is_minimal_and_stable() -> None:
    one = model(A16, B16, covariance=1e-12 * np.eye(6))
    # A(1) = 3e-4 against sqrt(3) 1e-6: far from the border for this covariance.
    assert stability_distance(one) == pytest.approx(3e-4 / (np.sqrt(3) * 1e-6), rel=1e-3)
