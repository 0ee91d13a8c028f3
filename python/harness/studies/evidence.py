# SPDX-License-Identifier: MIT
"""Medians with intervals, and what paired runs say of a claim."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt
from scipy.stats import binom

# A difference below this is none in practice.
MATTERS = 0.05
LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """A median and where the true one lies, with a confidence of 95 % whatever the distribution."""

    median: float
    low: float
    high: float


def median_interval(values: npt.ArrayLike, level: float = LEVEL) -> Interval:
    """Median of independent values, with the exact interval of its order statistics.

    The number of values below the true median is binomial with p = 1/2 (Conover, Practical
    Nonparametric Statistics, Wiley 1999, sec. 3.2). With fewer than six values no pair of them
    has 95 %: the interval is then infinite.
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
    """What the runs say of a claim that one figure is lower than another."""

    holds = "holds"
    fails = "fails"
    equal = "no difference"
    neither = "neither arrives"
    undecided = "undecided"


@dataclass(frozen=True)
class Comparison:
    """Median of the ratio of two figures in paired runs, and what follows."""

    ratio: Interval
    finding: Finding


def claim_lower(first: npt.ArrayLike, second: npt.ArrayLike) -> Comparison:
    """Is `first` lower than `second`? Positive figures of the same runs, shape (runs,) each.

    It holds where the interval of the median ratio lies below 1 - MATTERS or, if it does not, at
    least below 1 with its median below 1 - MATTERS; fails the other way round; no difference where
    all of it is within MATTERS of 1; else undecided.
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
