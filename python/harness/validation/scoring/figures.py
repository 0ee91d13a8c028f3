# SPDX-License-Identifier: MIT
"""Figures with intervals and targets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import stats

LEVEL = 0.9  # of every interval
Unit = Literal["share", "count", "seconds", "nats"]
Met = Literal["met", "met, not surely", "missed, not surely", "missed", "no target", "no data"]


@dataclass(frozen=True)
class Range:
    """A target: values from least to most meet it."""

    least: float = -math.inf
    most: float = math.inf

    def holds(self, value: float) -> bool:
        """The value meets it."""
        return self.least <= value <= self.most


@dataclass(frozen=True)
class Figure:
    """A number that a check is judged by.

    Attributes
    ----------
    words
        what it is.
    value
        NaN where there is no case for it.
    low, high
        interval of 90 %: Wilson's of a share (J. Am. Stat. Assoc. 22, 1927), that of order
        statistics of a quantile, percentiles of a bootstrap of a mean.
    n
        cases, or what else it is counted over.
    unit
        of value, low and high.
    target
        None where there is none.
    """

    words: str
    value: float
    low: float
    high: float
    n: int
    unit: Unit = "share"
    target: Range | None = None

    @property
    def met(self) -> Met:
        """Whether the target is met, and whether by the whole interval."""
        if self.target is None:
            return "no target"
        if not self.n:
            return "no data"
        ends = [self.target.holds(end) for end in (self.low, self.high)]
        if self.target.holds(self.value):
            return "met" if all(ends) else "met, not surely"
        # An interval on both sides of a range that is narrower than itself holds it, too.
        over = self.low <= self.target.most and self.high >= self.target.least
        return "missed, not surely" if over else "missed"


def share(words: str, answers: Iterable[bool | None], target: Range | None = None) -> Figure:
    """How many of the answers are yes; None is no answer."""
    given = [answer for answer in answers if answer is not None]
    if not given:
        return Figure(words, math.nan, math.nan, math.nan, 0, "share", target)
    low, high = wilson(sum(given), len(given))
    return Figure(words, sum(given) / len(given), low, high, len(given), "share", target)


def wilson(hits: int, n: int) -> tuple[float, float]:
    """Interval of a share of n > 0."""
    found = stats.binomtest(hits, n).proportion_ci(LEVEL, method="wilson")
    return float(found.low), float(found.high)


def quantile(
    words: str,
    values: Sequence[float],
    p: float = 0.5,
    *,
    unit: Unit = "share",
    target: Range | None = None,
) -> Figure:
    """A quantile with the interval of order statistics, an end of it at the extremes if need be."""
    kept = np.array([value for value in values if math.isfinite(value)])
    if not kept.size:
        return Figure(words, math.nan, math.nan, math.nan, 0, unit, target)
    found: Any = stats.quantile_test(kept, p=p).confidence_interval(LEVEL)
    low = kept.min() if np.isnan(found.low) else found.low
    high = kept.max() if np.isnan(found.high) else found.high
    value = float(np.quantile(kept, p))
    return Figure(words, value, float(low), float(high), kept.size, unit, target)


def mean(
    words: str, values: Sequence[float], *, unit: Unit = "count", target: Range | None = None
) -> Figure:
    """A mean with the interval of a bootstrap, seeded."""
    kept = np.array([value for value in values if math.isfinite(value)])
    if not kept.size:
        return Figure(words, math.nan, math.nan, math.nan, 0, unit, target)
    value = low = high = float(kept.mean())
    if kept.size > 1:
        found = stats.bootstrap(
            (kept,),
            np.mean,
            confidence_level=LEVEL,
            n_resamples=2000,
            method="percentile",
            rng=np.random.default_rng(0),
        ).confidence_interval
        low, high = float(found.low), float(found.high)
    return Figure(words, value, low, high, kept.size, unit, target)
