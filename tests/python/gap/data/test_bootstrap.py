# SPDX-License-Identifier: MIT
"""The bootstrap over windows against that of scipy, which has the same stream of draws."""

import numpy as np
import pytest
from scipy import stats

from ehsid.harness.gap.data.bootstrap import drawn_counts, drawn_windows, interval
from ehsid.harness.gap.thresholds import BOOTSTRAP_DRAWS, SHRINKAGE_LEVEL


def test_intervals_are_those_of_scipy() -> None:
    values = np.random.default_rng(1).lognormal(size=30)
    expected = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=BOOTSTRAP_DRAWS,
        confidence_level=SHRINKAGE_LEVEL,
        method="percentile",
        rng=np.random.default_rng(7),
    ).confidence_interval
    draws = values[drawn_windows(30, np.random.default_rng(7))].mean(axis=1)
    assert interval(draws) == pytest.approx((expected.low, expected.high), rel=1e-12)


def test_counts_are_those_of_draws_with_replacement() -> None:
    counts = drawn_counts(20, np.random.default_rng(2))
    draws = drawn_windows(20, np.random.default_rng(3))
    assert (counts.sum(axis=1) == 20).all()
    # The count of a window is binomial with 20 draws and p = 1/20: its variance is 0.95. The
    # standard error of the variance of 500 x 20 counts is sqrt((kurtosis - 1) / 10^4), about 2 %;
    # the tolerance is three of them.
    expected_counts = np.array([np.bincount(draw, minlength=20) for draw in draws])
    for each in (counts, expected_counts):
        assert each.var() == pytest.approx(0.95, rel=0.06)


def test_draws_without_a_value_are_left_out() -> None:
    values = np.arange(101.0)
    assert interval(values) == pytest.approx((5.0, 95.0))
    assert interval(np.append(values, np.nan)) == interval(values)
