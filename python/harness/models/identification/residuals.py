# SPDX-License-Identifier: MIT
"""Tests residuals for whiteness and for independence of the input.

L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, sec. 16.6;
G. M. Ljung, G. E. P. Box, "On a measure of lack of fit in time series models", Biometrika 65, 1978.

Predicts the output with an ARX model: one step ahead, and as a free run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.signal
import scipy.stats

from ...base.numbers import FloatArray
from .arx import ArxModel, regression
from .data import IoData, TooFewSamplesError

MAX_LAG = 25
LEVEL = 0.99


@dataclass(frozen=True, eq=False)
class WhitenessTest:
    """Result of the whiteness test, from the autocorrelation of the residual."""

    lags: npt.NDArray[np.int64]
    """Shape (max_lag,), lags 1..max_lag in samples."""
    correlation: FloatArray
    """Shape (max_lag,), normalised autocorrelation r_e(tau) / r_e(0)."""
    band: float
    """Half width of the 99 % band of a single lag, for a white residual."""
    n_outside: int
    """Number of lags outside the band; `expected_outside` is the number expected by chance."""
    expected_outside: float
    statistic: float
    degrees_of_freedom: int
    p_value: float
    """Ljung-Box test over all lags together."""
    passed: bool
    """Whether p_value >= 0.01."""
    verdict: str
    """The result in words."""


@dataclass(frozen=True, eq=False)
class IndependenceTest:
    """Result of the independence test, from the cross-correlation of residual and input."""

    lags: npt.NDArray[np.int64]
    """Shape (2 max_lag + 1,), lags -max_lag..max_lag in samples; at a positive lag the input is
    earlier than the residual."""
    correlation: FloatArray
    """Shape (2 max_lag + 1,), normalised cross-correlation r_eu(tau) / sqrt(r_e(0) r_u(0))."""
    band: float
    """Half width of the 99 % band of a single lag."""
    family_band: float
    """Half width of the band inside which all lags 0..max_lag lie together with 99 % probability.
    """
    n_outside: int
    """Number of lags 0..max_lag outside `band`."""
    passed: bool
    """Whether no lag 0..max_lag is outside `family_band`."""
    feedback: bool
    """Whether a negative lag is outside `family_band`, so that the input reacts to the residual."""
    verdict: str
    """The result in words."""


def whiteness_test(
    residual: FloatArray,
    *,
    runs: Sequence[slice] | None = None,
    max_lag: int = MAX_LAG,
    n_fitted: int = 0,
) -> WhitenessTest:
    """Tests whether the residual is white.

    Parameters
    ----------
    residual
        residual, shape (N,).
    runs
        slices of consecutive samples; no product of two samples reaches beyond the end of a slice.
    max_lag
        largest lag in samples, 1 <= max_lag < N.
    n_fitted
        na if the residual is that of the data to which the model was fitted, because the fit takes
        na degrees of freedom; 0 for other data.

    Raises
    ------
    TooFewSamplesError
        N is not above max_lag.
    """
    e, runs = _centred(residual, runs, max_lag)
    n = e.size
    lags = np.arange(1, max_lag + 1, dtype=np.int64)
    variance = float(np.mean(e**2))
    correlation = np.array([_covariance(e, e, lag, runs) for lag in range(1, max_lag + 1)]) / (
        variance or 1.0
    )
    band = _quantile(LEVEL) / np.sqrt(n)
    # Q = N (N + 2) sum rho(tau)^2 / (N - tau), N - tau being the number of products at lag tau.
    products = np.array([sum(max(run.stop - run.start - lag, 0) for run in runs) for lag in lags])
    used = products > 0
    statistic = float(n * (n + 2) * np.sum(correlation[used] ** 2 / products[used]))
    freedom = max(int(used.sum()) - n_fitted, 1)
    p_value = float(scipy.stats.chi2.sf(statistic, freedom))
    outside = int(np.sum(np.abs(correlation) > band))
    passed = p_value >= 1.0 - LEVEL
    verdict = (
        f"{'white' if passed else 'not white'}: Ljung-Box p = {p_value:.2g} over {max_lag} lags "
        f"({'not below' if passed else 'below'} 0.01), {outside} of {max_lag} lags outside the "
        f"99 % band (by chance {(1 - LEVEL) * max_lag:.2g})"
    )
    return WhitenessTest(
        lags, correlation, float(band), outside, (1 - LEVEL) * max_lag, statistic, freedom, p_value,
        passed, verdict,
    )  # fmt: skip


def independence_test(
    residual: FloatArray,
    u: FloatArray,
    *,
    runs: Sequence[slice] | None = None,
    max_lag: int = MAX_LAG,
) -> IndependenceTest:
    """Tests whether the residual is independent of the present and past input.

    For any stationary residual that is independent of the input, white or not, the distribution of
    sqrt(N) r_eu(tau) tends to a normal one of variance P = sum_k r_e(k) r_u(k). The sum is taken
    up to max_lag with a Bartlett window, which keeps it positive.

    Parameters
    ----------
    residual
        residual, shape (N,).
    u
        input at the same samples, shape (N,).
    runs
        slices of consecutive samples.
    max_lag
        largest lag in samples, 1 <= max_lag < N.

    Raises
    ------
    TooFewSamplesError
        N is not above max_lag.
    """
    e, runs = _centred(residual, runs, max_lag)
    u, _ = _centred(u, runs, max_lag)
    lags = np.arange(-max_lag, max_lag + 1, dtype=np.int64)
    r_eu = np.array([_covariance(e, u, lag, runs) for lag in lags.tolist()])
    taper = 1.0 - np.abs(lags) / (max_lag + 1.0)
    r_e = np.array([_covariance(e, e, lag, runs) for lag in lags.tolist()])
    r_u = np.array([_covariance(u, u, lag, runs) for lag in lags.tolist()])
    p = float(np.sum(taper * r_e * r_u))

    scale = float(np.sqrt(np.mean(e**2) * np.mean(u**2))) or 1.0
    deviation = np.sqrt(p / e.size) / scale
    band = _quantile(LEVEL) * deviation
    # Bonferroni: all max_lag + 1 lags lie inside the band together with a probability of at least
    # 99 %, however they depend on each other.
    family_band = _quantile(1.0 - (1.0 - LEVEL) / (max_lag + 1)) * deviation
    correlation = r_eu / scale
    size = np.abs(correlation)
    causal = lags >= 0
    outside = int(np.sum(size[causal] > band))
    passed = bool(np.all(size[causal] <= family_band))
    feedback = bool(np.any(size[~causal] > family_band))
    worst = int(lags[causal][np.argmax(size[causal])])
    verdict = (
        f"{'independent of' if passed else 'depends on'} the input: the largest correlation with "
        f"the present and past input, {np.max(size[causal]):.3f} at lag {worst}, is "
        f"{'inside' if passed else 'outside'} the 99 % band for all {max_lag + 1} lags together, "
        f"{family_band:.3f}, which decides ({outside} of the lags are outside the band of a single "
        f"lag, {band:.3f})"
    )
    if feedback:
        verdict += "; it is correlated with later inputs, too"
    return IndependenceTest(
        lags, correlation, float(band), float(family_band), outside, passed, feedback, verdict
    )


def _centred(
    signal: FloatArray, runs: Sequence[slice] | None, max_lag: int
) -> tuple[FloatArray, Sequence[slice]]:
    if signal.size <= max_lag:
        raise TooFewSamplesError(
            f"{signal.size} residuals are too few for correlations up to lag {max_lag}"
        )
    return signal - np.mean(signal), runs if runs is not None else (slice(0, signal.size),)


def _covariance(x: FloatArray, y: FloatArray, lag: int, runs: Sequence[slice]) -> float:
    """Returns (1/N) sum_k x(k) y(k - lag) over all k for which both samples are in the same run."""
    if lag < 0:
        return _covariance(y, x, -lag, runs)
    total = sum(float(x[r][lag:] @ y[r][: max(r.stop - r.start - lag, 0)]) for r in runs)
    return total / x.size


def _quantile(level: float) -> float:
    """Returns the half width of the two-sided interval of a standard normal variable."""
    return float(scipy.stats.norm.ppf(0.5 + 0.5 * level))


@dataclass(frozen=True, eq=False)
class Prediction:
    """Measured and predicted output, in the units of the data."""

    index: npt.NDArray[np.int64]
    """Shape (n,), sample numbers."""
    measured: FloatArray
    predicted: FloatArray
    """Shape (n,), measured and predicted output; the prediction of an unstable free run may end in
    non-finite values."""
    runs: tuple[slice, ...]
    """Slices of consecutive samples."""

    @property
    def residual(self) -> FloatArray:
        """Residual, measured minus predicted output, shape (n,)."""
        return self.measured - self.predicted


def predict_one_step(model: ArxModel, data: IoData, *, skip: int | None = None) -> Prediction:
    """Returns the one-step prediction y_hat(k) = phi(k)' theta with measured past outputs, Eq. (8).

    Parameters
    ----------
    model
        estimated model.
    data
        input and output.
    skip
        samples left out at the start of each segment, see `regression`.
    """
    rows = regression(model.centre(data), model.orders, skip=skip)
    return Prediction(
        rows.index, data.y[rows.index], rows.phi @ model.theta + model.y_mean, rows.runs
    )


def simulate(model: ArxModel, data: IoData, *, skip: int | None = None) -> Prediction:
    """Simulates a free run, in which the past outputs are those of the model.

    A(q^-1) y_hat(k) = q^-nk B(q^-1) u(k) + offset. Each segment starts from its first `skip`
    measured outputs, which the result does not contain.

    Parameters
    ----------
    model
        estimated model.
    data
        input and output.
    skip
        samples left out at the start of each segment, see `regression`.
    """
    centred = model.centre(data)
    rows = regression(centred, model.orders, skip=skip)
    numerator = np.concatenate((np.zeros(model.orders.nk), model.b))
    denominator = np.concatenate(([1.0], model.a))
    simulated = np.empty(rows.y.size)
    for run in rows.runs:
        k = rows.index[run]
        past = k[0] - 1 - np.arange(model.orders.n_history)
        state = scipy.signal.lfiltic(numerator, denominator, centred.y[past], centred.u[past])
        free, _ = scipy.signal.lfilter(numerator, denominator, centred.u[k], zi=state)
        constant = np.full(k.size, model.offset)
        response = scipy.signal.lfilter([1.0], denominator, constant)
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable model may give infinities
            simulated[run] = free + response
    return Prediction(rows.index, data.y[rows.index], simulated + model.y_mean, rows.runs)
