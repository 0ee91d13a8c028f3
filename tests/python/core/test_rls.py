# SPDX-License-Identifier: MIT
"""Rls against the numpy reference and batch least squares; test_peers.py has other libraries."""

import model16
import numpy as np
import numpy.typing as npt
import numpy_reference as reference
import policies
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

import ehsid

FloatArray = npt.NDArray[np.float64]
EPS = float(np.finfo(np.float64).eps)
N = 100_000


def record_with_bursts(seed: int, n: int) -> tuple[FloatArray, FloatArray]:
    """Regressors and output of model (16); every 2000 samples 50 with fourfold noise.

    The bursts make the error-driven policies forget, down to their least factor.
    """
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], size=n + 3)
    e = 0.1 * rng.normal(size=u.size) * np.where(np.arange(u.size) % 2000 >= 1950, 4.0, 1.0)
    return model16.regressors(u, model16.output(u, e))


@pytest.mark.slow
@pytest.mark.parametrize("samples", [4000, pytest.param(N, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("name", [*policies.NAMES, "error_driven with sigma0 given", "lambda = 1"])
def test_double_agrees_with_the_textbook(name: str, samples: int) -> None:
    pair = (
        policies.PAIRS
        | {
            "error_driven with sigma0 given": policies.pair(ehsid.ErrorDriven(noise_variance=0.01)),
            "lambda = 1": policies.pair(ehsid.Constant(1.0)),
        }
    )[name]
    phi, y = record_with_bursts(1, samples)
    rls = ehsid.Rls(6, forgetting=pair.compiled, options=policies.UNGUARDED, dtype="float64")
    path = rls.run(phi, y)
    numpy_rls = reference.Reference(np.zeros(6), np.full(6, 1e6), pair.written(6))
    innovation, factor, variance = (np.empty(samples) for _ in range(3))
    for k in range(samples):
        assert numpy_rls.update(phi[k], y[k])
        innovation[k] = numpy_rls.epsilon
        factor[k] = numpy_rls.factor
        variance[k] = numpy_rls.residual_variance

    # The gate is 1e-9. It is above what rounding can do: once the start is past a step rounds by
    # eps cond(P) = 2e-16 * 8e4 = 2e-11, and errors in P fade; at the start P falls from 1e6 to
    # order one and so loses eps 1e6 = 2e-10.
    assert (path.status == ehsid.Status.ok).all()
    assert np.ptp(factor) > 0.01 or name in ("constant", "lambda = 1")
    np.testing.assert_allclose(path.forgetting_factor, factor, rtol=1e-9, atol=0.0)
    np.testing.assert_allclose(path.innovation, innovation, rtol=0.0, atol=1e-9 * np.std(y))
    np.testing.assert_allclose(path.residual_variance, variance, rtol=1e-9, atol=1e-9 * np.var(y))
    np.testing.assert_allclose(rls.theta_hat, numpy_rls.theta, rtol=1e-9, atol=0.0)
    np.testing.assert_allclose(rls.gain, numpy_rls.gain, rtol=0, atol=1e-9 * abs(rls.gain).max())
    # Entries of P relative to the standard deviations that they belong to.
    size = np.sqrt(np.outer(np.diag(numpy_rls.P), np.diag(numpy_rls.P)))
    np.testing.assert_allclose(rls.P / size, numpy_rls.P / size, rtol=0.0, atol=1e-9)
    deviation = np.sqrt(numpy_rls.parameter_variance * np.diag(numpy_rls.P))
    np.testing.assert_allclose(rls.standard_deviation, deviation, rtol=1e-9, atol=0.0)


def prior_least_squares(
    phi: FloatArray, y: FloatArray, theta0: FloatArray, variance0: FloatArray
) -> FloatArray:
    """Least squares with the start values as n more equations, theta = theta0 weighted by P0^-1."""
    weight = 1.0 / np.sqrt(variance0)
    rows = np.vstack((np.diag(weight), phi))
    return np.linalg.lstsq(rows, np.concatenate((weight * theta0, y)), rcond=None)[0]


@given(
    n=st.integers(1, 13),
    samples=st.integers(1, 60),
    seed=st.integers(0, 2**32 - 1),
    log_variance=st.floats(-2.0, 3.0),
)
def test_lambda_one_is_least_squares_with_the_prior(
    n: int, samples: int, seed: int, log_variance: float
) -> None:
    rng = np.random.default_rng(seed)
    phi, y, theta0 = rng.normal(size=(samples, n)), rng.normal(size=samples), rng.normal(size=n)
    variance0 = 10.0 ** (log_variance + rng.uniform(-1.0, 1.0, size=n))
    rls = ehsid.Rls(
        n,
        forgetting=ehsid.Constant(1.0),
        options=policies.UNGUARDED,
        theta0=theta0,
        variance0=variance0,
        dtype="float64",
    )
    rls.run(phi, y)
    batch = prior_least_squares(phi, y, theta0, variance0)
    information = np.diag(1.0 / variance0) + phi.T @ phi
    # Each step rounds n times in a sum, and six times more in f d, alpha (twice), the division, the
    # increment and theta; the condition number of the normal equations carries that to theta and P.
    condition = np.linalg.cond(information)
    rounding = EPS * (samples + n) * (n + 6) * condition
    scale = np.abs(batch).max() + np.abs(theta0).max() + np.abs(y).max()
    np.testing.assert_allclose(rls.theta_hat, batch, rtol=0.0, atol=rounding * scale)
    inverse = np.linalg.inv(information)
    np.testing.assert_allclose(rls.P, inverse, rtol=0.0, atol=rounding * np.abs(inverse).max())


def test_float32_is_within_1e_4_of_a_double_batch_solution() -> None:
    u, y = model16.signals(2, N + 3)
    phi, y = model16.regressors(u, y)
    batch = prior_least_squares(phi, y, np.zeros(6), np.full(6, 1e6))
    rls = ehsid.Rls(6, forgetting=ehsid.Constant(1.0), dtype="float32")
    path = rls.run(phi, y)
    assert path.theta.dtype == np.float32
    # The gate of the project, each parameter by itself. For scale: rounding the record to float32
    # moves the batch solution itself by 1e-7.
    np.testing.assert_allclose(rls.theta_hat, batch, rtol=1e-4, atol=0.0)


def test_full_covariance_is_a_prior() -> None:
    rng = np.random.default_rng(4)
    root = rng.normal(size=(5, 5))
    p0, theta0 = root @ root.T + np.eye(5), rng.normal(size=5)
    phi, y = rng.normal(size=(40, 5)), rng.normal(size=40)
    rls = ehsid.Rls(5, forgetting=ehsid.Constant(1.0), options=policies.UNGUARDED, dtype="float64")
    rls.start_from_covariance(theta0, p0)
    np.testing.assert_allclose(rls.P, p0, rtol=0.0, atol=10.0 * EPS * np.abs(p0).max())
    rls.run(phi, y)
    information = np.linalg.inv(p0) + phi.T @ phi
    moment = np.linalg.solve(p0, theta0) + phi.T @ y
    # 45 equations of condition number about 30: 45 * 5 * 30 * eps = 1.5e-12.
    np.testing.assert_allclose(rls.theta_hat, np.linalg.solve(information, moment), atol=1.5e-12)
    np.testing.assert_allclose(rls.P, np.linalg.inv(information), atol=1.5e-12)


def test_residual_variance_and_deviations_have_their_statistical_meaning() -> None:
    """Over many records theta scatters as its standard deviations say, and sigma^2 is the noise."""
    thetas, deviations, variances = [], [], []
    for seed in range(200):
        u, y = model16.signals(seed, 1003, noise=0.1)
        rls = ehsid.Rls(6, forgetting=ehsid.Constant(1.0), dtype="float64")
        rls.run(*model16.regressors(u, y))
        thetas.append(rls.theta_hat)
        deviations.append(rls.standard_deviation)
        variances.append(rls.residual_variance)
    # Mean of 200 estimates with 994 degrees of freedom each: 0.01 sqrt(2 / 198800); five of those.
    assert abs(np.mean(variances) - 0.01) < 5.0 * 0.01 * np.sqrt(2.0 / 198_800.0)
    # A sample deviation of 200 is itself known to 5 %; five of those.
    ratio = np.std(thetas, axis=0) / np.mean(deviations, axis=0)
    assert np.abs(ratio - 1.0).max() < 5.0 / np.sqrt(2.0 * 200.0)


@pytest.mark.thorough
@pytest.mark.parametrize("factor", [1.0, 0.998, 0.99, 0.98, 0.95])
def test_intervals_hold_as_often_as_they_say_with_forgetting(factor: float) -> None:
    runs, n = 600, 1003
    held, variances = [], []
    # sigma^2 has (sum w)^2 / sum w^2 squares, less the parameters: a t quantile, not a normal one.
    weights = factor ** np.arange(n - 3)
    squares = weights.sum() ** 2 / (weights**2).sum()
    interval = scipy.stats.t.ppf(0.95, squares - 6.0)
    for seed in range(runs):
        u, y = model16.signals(1000 + seed, n, noise=0.1)
        rls = ehsid.Rls(6, forgetting=ehsid.Constant(factor), dtype="float64")
        rls.run(*model16.regressors(u, y))
        held.append(np.abs(rls.theta_hat - model16.THETA) < interval * rls.standard_deviation)
        variances.append(rls.residual_variance)
    # Five deviations of the mean of all runs.
    error = 0.01 * np.sqrt(2.0 / (squares * runs))
    assert abs(np.mean(variances) - 0.01) < 5.0 * error
    # The six of a run hang together, so only the runs count: four binomial deviations, 4.9 %.
    assert abs(np.mean(held) - 0.9) < 4.0 * np.sqrt(0.9 * 0.1 / runs)


@settings(max_examples=30)
@given(
    name=st.sampled_from(policies.NAMES),
    dtype=st.sampled_from(["float32", "float64"]),
    seed=st.integers(0, 1000),
)
def test_reset_keeps_theta_and_reset_all_starts_anew(name: str, dtype: str, seed: int) -> None:
    u, y = model16.signals(seed, 400)
    phi, y = model16.regressors(u, y)
    theta0 = np.linspace(0.25, 1.5, 6)  # exact in float32
    rls = ehsid.Rls(6, forgetting=policies.PAIRS[name].compiled, theta0=theta0, dtype=dtype)
    fresh = rls.save()
    path = rls.run(phi, y)
    theta, variance = rls.theta_hat, rls.residual_variance
    assert variance > 0.0
    rls.reset()
    np.testing.assert_array_equal(rls.theta_hat, theta)
    np.testing.assert_array_equal(rls.P, 1e6 * np.eye(6))
    assert rls.forgetting_factor == 1.0
    # The noise is what it was, so deviations are those of P0, not zero; to two roundings.
    assert rls.residual_variance == pytest.approx(variance, rel=4.0 * float(np.finfo(dtype).eps))
    rls.reset_all()
    assert rls.residual_variance == 0.0
    assert rls.save() == fresh
    assert policies.same_bits(path, rls.run(phi, y))


def test_predict_is_the_scalar_product() -> None:
    rls = ehsid.Rls(3, theta0=[1.0, -2.0, 0.5], dtype="float64")
    assert rls.predict([3.0, 1.0, 4.0]) == 3.0
