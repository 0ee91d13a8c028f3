# SPDX-License-Identifier: MIT
"""Residual tests: against statsmodels, and how often they are right and wrong."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import scipy.signal
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from identification_truth import model16
from statsmodels.stats.diagnostic import acorr_ljungbox
from statsmodels.tsa.stattools import acf, ccf

from ehsid.harness.models.identification import (
    ArxOrders,
    IoData,
    TooFewSamplesError,
    fit_arx,
    independence_test,
    predict_one_step,
    whiteness_test,
)

FloatArray = npt.NDArray[np.float64]


def coloured(rng: np.random.Generator, n: int, pole: float) -> FloatArray:
    """First-order autoregression of unit variance, in steady state."""
    e = np.sqrt(1 - pole**2) * rng.normal(size=n + 200)
    return scipy.signal.lfilter([1.0], [1.0, -pole], e)[200:]


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(40, 400),
    max_lag=st.integers(1, 30),
    n_fitted=st.integers(0, 4),
    mean=st.floats(-5, 5),
)
def test_whiteness_is_that_of_statsmodels(
    seed: int, n: int, max_lag: int, n_fitted: int, mean: float
) -> None:
    e = mean + coloured(np.random.default_rng(seed), n, 0.3)
    ours = whiteness_test(e, max_lag=max_lag, n_fitted=n_fitted)
    theirs = acf(e, adjusted=False, nlags=max_lag, fft=False)
    np.testing.assert_allclose(ours.correlation, theirs[1:], atol=1e-12)
    np.testing.assert_array_equal(ours.lags, np.arange(1, max_lag + 1))
    if n_fitted < max_lag:
        table = acorr_ljungbox(e, lags=[max_lag], model_df=n_fitted)
        assert ours.statistic == pytest.approx(table["lb_stat"].iloc[0], rel=1e-9)
        assert ours.p_value == pytest.approx(table["lb_pvalue"].iloc[0], rel=1e-7, abs=1e-300)
        assert ours.degrees_of_freedom == max_lag - n_fitted
    assert ours.band == pytest.approx(2.5758293 / np.sqrt(n), rel=1e-6)
    assert ours.n_outside == np.sum(np.abs(theirs[1:]) > ours.band)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(40, 400), max_lag=st.integers(1, 30))
def test_cross_correlation_is_that_of_statsmodels(seed: int, n: int, max_lag: int) -> None:
    rng = np.random.default_rng(seed)
    e, u = 2 + rng.normal(size=n), -1 + coloured(rng, n, 0.6)
    ours = independence_test(e, u, max_lag=max_lag)
    # Theirs at lag k pairs x(t + k) with y(t).
    later = ccf(e, u, adjusted=False, nlags=max_lag + 1)
    earlier = ccf(u, e, adjusted=False, nlags=max_lag + 1)
    np.testing.assert_allclose(ours.correlation[max_lag:], later, atol=1e-12)
    np.testing.assert_allclose(ours.correlation[max_lag::-1], earlier, atol=1e-12)
    assert ours.lags[0] == -max_lag
    assert ours.family_band > ours.band


@pytest.mark.slow
def test_the_bands_have_the_right_width_for_coloured_signals() -> None:
    """N var(r_eu) of independent e and u is the sum of r_e r_u: here known in closed form."""
    n, runs, pole_e, pole_u, max_lag = 1000, 400, 0.7, 0.8, 25
    rng = np.random.default_rng(11)
    at_lag_5, squared_bands = np.empty(runs), np.empty(runs)
    for i in range(runs):
        e, u = coloured(rng, n, pole_e), coloured(rng, n, pole_u)
        test = independence_test(e, u, max_lag=max_lag)
        at_lag_5[i] = test.correlation[max_lag + 5]
        squared_bands[i] = n * (test.band / 2.5758293) ** 2
    product = pole_e * pole_u
    exact = (1 + product) / (1 - product)  # sum of product^|k|: 3.55 times the naive 1
    # Sum of `runs` squares over the variance: chi-squared.
    low, high = scipy.stats.chi2.ppf([0.0005, 0.9995], runs) / runs
    assert low <= n * np.mean(at_lag_5**2) / exact <= high

    k = np.arange(-max_lag, max_lag + 1)
    tapered = float(np.sum((1 - np.abs(k) / (max_lag + 1)) * product ** np.abs(k)))
    # Sample covariances about sample means are too small by about the variance of the means,
    # (1 + p) / (1 - p) / n each: 51 terms (1 - pole..) of 0.0057 and 0.009 with mean weight 1/2.
    mean_error = (1 + pole_e) / (1 - pole_e) / n + (1 + pole_u) / (1 - pole_u) / n
    allowed = tapered * mean_error * 2 + 4 * np.std(squared_bands) / np.sqrt(runs)
    assert np.mean(squared_bands) == pytest.approx(tapered, abs=allowed)


@pytest.mark.thorough
def test_false_alarms_are_as_rare_as_claimed() -> None:
    runs, n = 400, 500
    rng = np.random.default_rng(12)
    not_white = dependent = outside = 0
    for _ in range(runs):
        e, u = rng.normal(size=n), coloured(rng, n, 0.9)
        white, independent = whiteness_test(e), independence_test(e, u)
        not_white += not white.passed
        outside += white.n_outside
        dependent += not independent.passed
    # Binomial(400, 0.01) exceeds 12 with probability 3e-4; the same for the Bonferroni bound. The
    # distributions are limits for large N, for which a rate of 0.015 is allowed: 15 at 3e-4.
    most = scipy.stats.binom.isf(5e-4, runs, 0.015)
    assert not_white <= most
    assert dependent <= most
    # 10,000 lags with 1 % each, nearly independent; finite N narrows rho by (N - lag) / N.
    low, high = scipy.stats.binom.ppf([5e-4, 1 - 5e-4], 25 * runs, 0.01 * np.array([0.8, 1.0]))
    assert low <= outside <= high


def test_a_model_of_too_low_an_order_fails_both_tests() -> None:
    u, y = model16(seed=13, n=1000)
    data = IoData.from_arrays(u, y)
    right, wrong = (
        predict_one_step(fit_arx(data, ArxOrders(n, n)), data, skip=3).residual for n in (3, 1)
    )
    assert whiteness_test(right, n_fitted=3).passed
    assert independence_test(right, u[3:]).passed
    failed = whiteness_test(wrong, n_fitted=1)
    assert not failed.passed
    assert failed.verdict.startswith("not white")
    dependent = independence_test(wrong, u[3:])
    assert not dependent.passed
    assert dependent.verdict.startswith("depends on the input")
    assert not dependent.feedback


def test_a_dependence_on_one_lag_is_found_at_that_lag() -> None:
    rng = np.random.default_rng(14)
    u, e = rng.normal(size=(2, 2000))
    e[7:] += 0.3 * u[:-7]
    test = independence_test(e, u)
    assert not test.passed
    assert not test.feedback
    assert test.lags[np.argmax(np.abs(test.correlation))] == 7
    assert "at lag 7, is outside the 99 % band for all 26 lags together" in test.verdict
    feedback = independence_test(u, e)  # now the "input" follows the "residual"
    assert feedback.passed
    assert feedback.feedback
    assert "is inside the 99 % band for all 26 lags together" in feedback.verdict
    assert feedback.verdict.endswith("correlated with later inputs, too")


def test_products_do_not_reach_over_a_gap() -> None:
    rng = np.random.default_rng(15)
    e, u = rng.normal(size=(2, 60))
    runs = (slice(0, 25), slice(25, 28), slice(28, 60))
    white = whiteness_test(e, runs=runs, max_lag=5)
    cross = independence_test(e, u, runs=runs, max_lag=5)
    e0, u0 = e - e.mean(), u - u.mean()
    for lag in range(1, 6):
        pairs = [(k, k - lag) for r in runs for k in range(r.start + lag, r.stop)]
        by_hand = sum(e0[k] * e0[j] for k, j in pairs) / np.sum(e0**2)
        assert white.correlation[lag - 1] == pytest.approx(by_hand)
        scale = np.sqrt(np.sum(e0**2) * np.sum(u0**2))
        assert cross.correlation[5 + lag] == pytest.approx(
            sum(e0[k] * u0[j] for k, j in pairs) / scale
        )
        assert cross.correlation[5 - lag] == pytest.approx(
            sum(u0[k] * e0[j] for k, j in pairs) / scale
        )


def test_limits() -> None:
    with pytest.raises(TooFewSamplesError, match="10 residuals are too few"):
        whiteness_test(np.ones(10), max_lag=10)
    silent = whiteness_test(np.zeros(50))
    assert silent.passed
    assert silent.statistic == 0.0
    still = independence_test(np.zeros(50), np.random.default_rng(1).normal(size=50))
    assert still.passed
    assert still.n_outside == 0
