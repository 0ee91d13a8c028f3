# SPDX-License-Identifier: MIT
"""Intervals against statsmodels and by simulation; targets."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from statsmodels.stats.proportion import proportion_confint

from ehsid.lab.scoring.figures import Figure, Range, mean, quantile, share, wilson


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_is_that_of_statsmodels(pair: tuple[int, int]) -> None:
    hits, n = pair
    # statsmodels' own 1e-3 of rounding at the ends: both clip to [0, 1]
    assert wilson(hits, n) == pytest.approx(
        proportion_confint(hits, n, alpha=0.1, method="wilson"), abs=1e-12
    )


def test_a_share_leaves_out_what_is_no_answer() -> None:
    found = share("x", [True, None, False, True, None, True])
    assert (found.value, found.n) == (0.75, 4)
    assert found.low < 0.75 < found.high
    empty = share("x", [None])
    assert empty.n == 0
    assert math.isnan(empty.value)


@pytest.mark.thorough
def test_intervals_of_the_median_hold_it_in_nine_of_ten() -> None:
    rng = np.random.default_rng(3)
    runs = 400
    held = 0
    for _ in range(runs):
        found = quantile("x", rng.lognormal(size=21).tolist())
        held += found.low <= 1.0 <= found.high
    # Order statistics hold at least what is told; three deviations of 400 draws below 0.9.
    assert held / runs > 0.9 - 3.0 * math.sqrt(0.09 / runs)


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=60), st.sampled_from([0.5, 0.9]))
def test_quantiles_lie_in_their_interval_and_in_the_data(values: list[float], p: float) -> None:
    found = quantile("x", [*values, math.nan, math.inf], p)
    assert found.n == len(values)
    assert found.value == pytest.approx(np.quantile(values, p))
    assert min(values) <= found.low <= found.high <= max(values)


def test_mean_of_the_same_numbers_is_certain() -> None:
    found = mean("x", [1.0] * 12)
    assert (found.value, found.low, found.high) == (1.0, 1.0, 1.0)
    assert mean("x", [2.0]).n == 1
    assert mean("x", []).n == 0


def test_the_interval_of_a_mean_is_about_that_of_student() -> None:
    values = np.random.default_rng(5).normal(size=200)
    found = mean("x", values.tolist())
    width = 2.0 * 1.645 * values.std() / math.sqrt(200)
    # 2000 draws know the ends to a few per cent of the width
    assert found.high - found.low == pytest.approx(width, rel=0.1)


@pytest.mark.parametrize(
    ("value", "low", "high", "n", "target", "met"),
    [
        (0.99, 0.98, 1.0, 200, Range(least=0.97), "met"),
        (0.98, 0.95, 0.99, 80, Range(least=0.97), "met, not surely"),
        (0.96, 0.93, 0.98, 80, Range(least=0.97), "missed, not surely"),
        (0.90, 0.85, 0.93, 80, Range(least=0.97), "missed"),
        (0.01, 0.0, 0.02, 80, Range(most=0.02), "met"),
        (0.05, 0.03, 0.09, 80, Range(most=0.02), "missed"),
        (0.99, 0.97, 1.0, 80, Range(0.85, 0.95), "missed"),
        (0.96, 0.93, 0.98, 80, Range(0.85, 0.95), "missed, not surely"),
        (0.90, 0.86, 0.94, 80, Range(0.85, 0.95), "met"),
        (math.nan, math.nan, math.nan, 0, Range(most=0.02), "no data"),
        (0.5, 0.4, 0.6, 80, None, "no target"),
    ],
)
def test_targets(
    value: float, low: float, high: float, n: int, target: Range | None, met: str
) -> None:
    assert Figure("x", value, low, high, n, "share", target).met == met
