# SPDX-License-Identifier: MIT
"""The bootstrap over windows against that of scipy, which has the same stream of draws."""

import numpy as np
import pytest
from scipy import stats

from ehsid.harness.diagnosis.data.regimes import (
    BOOTSTRAP_DRAWS,
    SHRINKAGE_LEVEL,
    drawn_windows,
    interval,
)


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
    draws = values[drawn_windows(30, 7)].mean(axis=1)
    assert interval(draws) == pytest.approx((expected.low, expected.high), rel=1e-12)


def test_draws_without_a_value_are_left_out() -> None:
    values = np.arange(101.0)
    assert interval(values) == pytest.approx((5.0, 95.0))
    assert interval(np.append(values, np.nan)) == interval(values)
