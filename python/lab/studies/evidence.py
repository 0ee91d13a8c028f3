# SPDX-License-Identifier: MIT
"""Medians with confidence intervals, and tests of a claim by paired runs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt
from scipy.stats import binom

# A relative difference below this has no practical importance.
MATTERS = 0.05
LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """A median with its confidence interval, 95 % by default, valid for any distribution."""

    median: float
    low: float
    high: float


def median_interval(values: npt.ArrayLike, level: float = LEVEL) -> Interval:
    """Returns the median of independent values, with its exact interval from order statistics.

    The number of values below the true median is binomial with p = 1/2 (Conover, Practical
    Nonparametric Statistics, Wiley 1999, sec. 3.2). With fewer than six values no pair of them
    reaches a confidence of 95 %: the interval is then infinite.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    n = ordered.size
    # Largest k with P(X <= k - 1) <= (1 - level) / 2.
    k = int(binom.ppf(0.5 * (1.0 - level), n, 0.5))
    while k > 0 and binom.cdf(k - 1, n, 0.5) > 0.5 * (1.0 - level):
        k -= 1
    low, high = (ordered[k - 1], ordered[n - k]) if k > 0 else (-np.inf, np.inf)
    return Interval(float(np.median(ordered)), float(low), float(high))


class Finding(StrEnum):
    """Result of the paired runs on a claim that one figure is lower than another."""

    holds = "holds"
    fails = "fails"
    equal = "no difference"
    neither = "neither arrives"
    undecided = "undecided"


@dataclass(frozen=True)
class Comparison:
    """Median of the ratio of two figures in paired runs, and the finding on the claim."""

    ratio: Interval
    finding: Finding


def claim_lower(first: npt.ArrayLike, second: npt.ArrayLike) -> Comparison:
    """Tests the claim that `first` is lower than `second`, both of shape (runs,) and positive.

    The ratio first / second is taken run by run. The claim holds if the interval of the median
    ratio lies below 1 and the median below 1 - MATTERS. It fails if the interval lies above 1 and
    the median above 1 + MATTERS. There is no difference if the whole interval is within MATTERS of
    1. In all other cases the claim is undecided.
    """
    ratio = median_interval(
        np.asarray(first, dtype=np.float64) / np.asarray(second, dtype=np.float64)
    )
    if ratio.high < 1.0 and ratio.median < 1.0 - MATTERS:
        finding = Finding.holds
    elif ratio.low > 1.0 and ratio.median > 1.0 + MATTERS:
        finding = Finding.fails
    elif ratio.low >= 1.0 - MATTERS and ratio.high <= 1.0 + MATTERS:
        finding = Finding.equal
    else:
        finding = Finding.undecided
    return Comparison(ratio, finding)
