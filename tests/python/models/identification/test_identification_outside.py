# SPDX-License-Identifier: MIT
"""Criteria of a whole identification against statsmodels' AutoReg, definitions converted.

AutoReg fits the same equation by least squares and reports, with N rows and d parameters,
sigma2 = V, AIC = -2 ln L + 2 (d + 1) and BIC = -2 ln L + (d + 1) ln N with the normal likelihood
-2 ln L = N (ln 2 pi + ln V + 1), the variance counted as a parameter, and FPE = V (N + d) / (N - d)
(Luetkepohl, New Introduction to Multiple Time Series Analysis, 2005, ch. 4).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_truth import model16
from sources import ROOT
from statsmodels.tsa.ar_model import AutoReg, AutoRegResultsWrapper

from ehsid.harness.models.identification import Candidate, IoData, identify
from ehsid.harness.records import read_record

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"


def outside(u: np.ndarray, y: np.ndarray, candidate: Candidate, skip: int) -> AutoRegResultsWrapper:
    """The same rows: AutoReg leaves out its own lags only, so that it starts na before `skip`."""
    orders = candidate.orders
    k = np.arange(skip - orders.na, y.size)
    delayed = np.column_stack([u[k - orders.nk - i] for i in range(orders.nb)])
    return AutoReg(y[k], lags=orders.na, exog=delayed, trend="c" if orders.offset else "n").fit()


def compare(u: np.ndarray, y: np.ndarray, offset: bool) -> None:
    result = identify(IoData.from_arrays(u, y), orders=[2, 3, 4], delays=[1, 2], offset=offset)
    half = result.n_estimation
    for candidate in result.candidates:
        # The longest history of all: nk + nb - 1 = 5.
        theirs = outside(u[:half], y[:half], candidate, 5)
        ours = candidate.estimation
        n, d = ours.n_rows, candidate.orders.n_parameters
        assert theirs.nobs == n
        assert theirs.df_model == d
        assert ours.loss == pytest.approx(theirs.sigma2, rel=1e-9)
        assert ours.fpe == pytest.approx(theirs.fpe, rel=1e-9)
        likelihood = math.log(2.0 * math.pi) + 1.0
        assert ours.aic == pytest.approx(theirs.aic / n - likelihood - 2.0 / n, abs=1e-9)
        penalty = theirs.bic / n - likelihood - math.log(n) / n - math.log(theirs.sigma2)
        assert ours.mdl == pytest.approx(ours.loss * (1.0 + penalty), rel=1e-9)
        # Their order: constant, lags of y with the other sign, input.
        start = int(offset)
        order = [*range(start, start + d - start), *([0] if offset else [])]
        sign = np.r_[-np.ones(candidate.orders.na), np.ones(d - candidate.orders.na)]
        np.testing.assert_allclose(
            candidate.model.theta, sign * theirs.params[order], rtol=1e-6, atol=1e-9
        )


@pytest.mark.slow
@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), noise=st.floats(0.01, 1.0), offset=st.booleans())
def test_on_model_16(seed: int, noise: float, offset: bool) -> None:
    u, y = model16(seed=seed, n=500, noise=noise)
    compare(u, y, offset)


def test_on_the_crane() -> None:
    record = read_record(CRANE, columns=("valve_opening", "oil_pressure"))
    compare(record.column("valve_opening"), record.column("oil_pressure"), True)
