# SPDX-License-Identifier: MIT
"""Figures of a score, with confidence intervals and targets."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import stats

from ehsid.harness.base.arrays import FloatArray

LEVEL = 0.9  # level of every confidence interval
Unit = Literal["share", "count", "seconds", "nats"]
Met = Literal["met", "met, not surely", "missed, not surely", "missed", "no target", "no data"]


@dataclass(frozen=True)
class Range:
    """A target: the values from `least` to `most` meet it; an infinite end is no limit."""

    least: float = -math.inf
    most: float = math.inf

    def holds(self, value: float) -> bool:
        """Whether the value meets the target."""
        return self.least <= value <= self.most


@dataclass(frozen=True)
class Figure:
    """A number that a check is judged by.

    Attributes
    ----------
    words
        name of the figure.
    value
        the figure; NaN where there is no case for it.
    low, high
        90 % interval: Wilson's for a share (J. Am. Stat. Assoc. 22, 1927), that of order statistics
        for a quantile, percentiles of a bootstrap for a mean.
    n
        number of cases, or of other items over which it is computed.
    unit
        unit of value, low and high.
    target
        None where there is no target.
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
        """Whether the value meets the target, and whether the interval makes that sure."""
        if self.target is None:
            return "no target"
        if not self.n:
            return "no data"
        ends = [self.target.holds(end) for end in (self.low, self.high)]
        if self.target.holds(self.value):
            return "met" if all(ends) else "met, not surely"
        # The interval may overlap the target although neither of its ends lies in it.
        over = self.low <= self.target.most and self.high >= self.target.least
        return "missed, not surely" if over else "missed"


def share(words: str, answers: Iterable[bool | None], target: Range | None = None) -> Figure:
    """Share of the answers that are True; an answer of None does not count."""
    given = [answer for answer in answers if answer is not None]
    if not given:
        return _no_data(words, "share", target)
    low, high = wilson(sum(given), len(given))
    return Figure(words, sum(given) / len(given), low, high, len(given), "share", target)


def wilson(hits: int, n: int) -> tuple[float, float]:
    """Wilson's interval of the share `hits` / `n`, n > 0."""
    interval = stats.binomtest(hits, n).proportion_ci(LEVEL, method="wilson")
    return float(interval.low), float(interval.high)


def quantile(
    words: str,
    values: Iterable[float],
    p: float = 0.5,
    *,
    unit: Unit = "share",
    target: Range | None = None,
) -> Figure:
    """Quantile of the finite values, with the interval of order statistics.

    Where the interval has no end, the end is the smallest or largest value.
    """
    kept = _finite(values)
    if not kept.size:
        return _no_data(words, unit, target)
    interval: Any = stats.quantile_test(kept, p=p).confidence_interval(LEVEL)
    low = kept.min() if np.isnan(interval.low) else interval.low
    high = kept.max() if np.isnan(interval.high) else interval.high
    value = float(np.quantile(kept, p))
    return Figure(words, value, float(low), float(high), kept.size, unit, target)


def mean(
    words: str, values: Iterable[float], *, unit: Unit = "count", target: Range | None = None
) -> Figure:
    """Mean of the finite values, with the interval of a bootstrap that has a fixed seed."""
    kept = _finite(values)
    if not kept.size:
        return _no_data(words, unit, target)
    value = low = high = float(kept.mean())
    if kept.size > 1:
        interval = stats.bootstrap(
            (kept,),
            np.mean,
            confidence_level=LEVEL,
            n_resamples=2000,
            method="percentile",
            rng=np.random.default_rng(0),
        ).confidence_interval
        low, high = float(interval.low), float(interval.high)
    return Figure(words, value, low, high, kept.size, unit, target)


def _finite(values: Iterable[float]) -> FloatArray:
    return np.array([value for value in values if math.isfinite(value)], dtype=np.float64)


def _no_data(words: str, unit: Unit, target: Range | None) -> Figure:
    return Figure(words, math.nan, math.nan, math.nan, 0, unit, target)
