# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import quantile_test

from ehsid.lab.studies.claims import Finding, claim_lower, median_interval


@given(n=st.integers(1, 120), seed=st.integers(0, 10_000))
def test_interval_is_that_of_the_quantile_test_of_scipy(n: int, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal(n)
    found = median_interval(values)
    low, high = quantile_test(values, q=0.0, p=0.5).confidence_interval(0.95)
    # Scipy leaves a side open as NaN where no order statistic reaches the level.
    assert found.low == (-np.inf if np.isnan(low) else low)
    assert found.high == (np.inf if np.isnan(high) else high)
    assert found.median == np.median(values)


@pytest.mark.parametrize(
    ("ratio", "scatter", "finding"),
    [
        (0.5, 0.1, Finding.holds),
        (2.0, 0.1, Finding.fails),
        (1.0, 0.01, Finding.equal),
        (0.97, 0.01, Finding.equal),  # sure, but too small to matter
        (1.0, 2.0, Finding.undecided),
    ],
)
def test_findings(ratio: float, scatter: float, finding: Finding) -> None:
    rng = np.random.default_rng(1)
    second = rng.uniform(1.0, 5.0, 40)
    first = second * ratio * np.exp(scatter * rng.standard_normal(40))
    assert claim_lower(first, second).finding is finding


@given(seed=st.integers(0, 1000), shift=st.floats(-1.0, 1.0))
def test_a_claim_and_its_opposite_never_both_hold(seed: int, shift: float) -> None:
    rng = np.random.default_rng(seed)
    first, second = np.exp(rng.standard_normal((2, 24)) + np.array([[shift], [0.0]]))
    one, other = claim_lower(first, second).finding, claim_lower(second, first).finding
    assert not (one is Finding.holds and other is not Finding.fails)
    assert not (other is Finding.holds and one is Finding.holds)
