# SPDX-License-Identifier: MIT
"""ArxEstimator.seed: a start from an estimate made elsewhere."""

import model16
import numpy as np
import numpy.typing as npt
import policies
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid
from ehsid.harness.firmware import Seed

FloatArray = npt.NDArray[np.float64]


@given(
    seed=st.integers(0, 1000),
    cut=st.integers(50, 350),
    power_u=st.integers(-6, 6),
    power_y=st.integers(-6, 6),
)
def test_least_squares_goes_on_where_the_offline_fit_ended(
    seed: int, cut: int, power_u: int, power_y: int
) -> None:
    """Batch over the first part, recursion over the rest: together the batch over both."""
    u, y = model16.signals(seed, 400)
    phi, right = model16.regressors(u, y)
    first = slice(0, cut)
    p = np.linalg.inv(phi[first].T @ phi[first])
    start = Seed.from_covariance(p @ phi[first].T @ right[first], p, 0.0)
    scale_u, scale_y = 2.0**power_u, 2.0**power_y
    estimator = ehsid.ArxEstimator(
        3,
        3,
        1,
        forgetting=ehsid.Constant(1.0),
        reset=None,
        rls=policies.UNGUARDED,
        scaling=ehsid.Scaling(command_scale=scale_u, position_scale=scale_y),
        dtype="float64",
    )
    unit = np.array([1.0] * 3 + [scale_y / scale_u] * 3)
    estimator.seed(start.theta * unit, start.u, start.d)
    # The history has to fill: three samples again.
    estimator.run(scale_u * u[cut:], scale_y * y[cut:])
    whole = np.linalg.lstsq(phi, right, rcond=None)[0]
    # Condition of phi' phi about 1e3, of the rounding in 400 steps about 1e3 eps: 1e-9.
    np.testing.assert_allclose(estimator.theta_hat / unit, whole, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(estimator.P, np.linalg.inv(phi.T @ phi), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("theta", "u", "d"),
    [
        (np.zeros(5), np.eye(6), np.ones(6)),
        (np.zeros(0), np.eye(6), np.ones(6)),
        (np.zeros(6), np.eye(5), np.ones(6)),
        (np.zeros(6), np.ones(6), np.ones(6)),
        (np.zeros(6), np.tril(np.ones((6, 6))), np.ones(6)),
        (np.zeros(6), np.eye(6), np.ones(7)),
        (np.zeros(6), np.eye(6), np.zeros(6)),
        (np.zeros(6), np.eye(6), np.full(6, 1e-60)),  # zero in float32
    ],
)
def test_seeds_of_another_shape_are_refused(
    theta: FloatArray, u: FloatArray, d: FloatArray
) -> None:
    estimator = ehsid.ArxEstimator(3, 3, 1, dtype="float32")
    before = estimator.save()
    with pytest.raises(ValueError, match=r"theta|\bu\b|\bd\b"):
        estimator.seed(theta, u, d)
    assert estimator.save() == before


@given(name=st.sampled_from(policies.NAMES), seed=st.integers(0, 1000))
def test_a_seed_is_the_estimate_and_a_reset_the_vague_start(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    theta, d = rng.normal(size=6), 10.0 ** rng.uniform(-3.0, 1.0, size=6)
    u = np.triu(rng.normal(size=(6, 6)), 1) + np.eye(6)
    estimator = ehsid.ArxEstimator(
        3, 3, 1, forgetting=policies.PAIRS[name].compiled, variance0=[1e4] * 6, dtype="float64"
    )
    estimator.seed(theta, u, d, 0.25)
    np.testing.assert_array_equal(estimator.theta_hat, theta)
    # n products, each rounded.
    np.testing.assert_allclose(estimator.P, (u * d) @ u.T, rtol=0.0, atol=1e-14 * d.max() * 36)
    assert estimator.residual_variance == pytest.approx(0.25, rel=1e-14)
    deviation = np.sqrt(0.25 * np.diag((u * d) @ u.T))
    np.testing.assert_allclose(estimator.standard_deviation, deviation, rtol=1e-12)
    estimator.reset()
    np.testing.assert_array_equal(estimator.theta_hat, theta)
    np.testing.assert_array_equal(estimator.P, 1e4 * np.eye(6))
