# SPDX-License-Identifier: MIT
"""Figures of a score, with confidence intervals and targets.

Calibration of what a diagnosis claims: its probabilities, and its sizes with their intervals.

Of all effects named with a probability of 0.9, nine in ten should be true; of all intervals of
90 %, nine in ten should contain the true value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import stats

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.diagnosis.schema import Estimate

from .judging import ScoredCase, is_true

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
    """A number that a check is judged by."""

    words: str
    """Name of the figure."""
    value: float
    """The figure; NaN where there is no case for it."""
    low: float
    high: float
    """90 % interval: Wilson's for a share (J. Am. Stat. Assoc. 22, 1927), that of order statistics
    for a quantile, percentiles of a bootstrap for a mean."""
    n: int
    """Number of cases, or of other items over which it is computed."""
    unit: Unit = "share"
    """Unit of value, low and high."""
    target: Range | None = None
    """None where there is no target."""

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


# Edges of the bins; they are closest between 0.8 and 1, the range of interest.
EDGES = (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 1.0)


@dataclass(frozen=True)
class Claim:
    """The probability of an effect that was named, and whether the machine has this effect."""

    probability: float
    true: bool


@dataclass(frozen=True)
class Bin:
    """Claims with probabilities in one bin: the mean probability, and the share that is true."""

    probability: float
    true: Figure


@dataclass(frozen=True)
class Reliability:
    """How well the probabilities of the named effects agree with the share that is true."""

    bins: tuple[Bin, ...]
    """Bins that contain claims, by rising probability."""
    claims: int
    """Number of all effects named."""
    brier: float
    """Mean of (p - true)^2 (G. W. Brier, Monthly Weather Review 78(1), 1950); 0 is best."""
    brier_constant: float
    """Brier score of a constant p, the share that is true; a higher `brier` is worse than none."""
    expected_error: float
    """Sum over bins of their share of the claims times |mean probability - share true|."""


@dataclass(frozen=True)
class RiskPoint:
    """A point of the risk-coverage curve."""

    threshold: float
    """Lowest probability of the names that are kept."""
    coverage: float
    """Share of all cases in which the first name is kept."""
    risk: Figure
    """Share of the kept names that are wrong."""


@dataclass(frozen=True)
class SizeError:
    """Error of a parameter of an effect that was rightly named, or of a value in the rig file.

    Attributes
    ----------
    relative
        |estimate - true| / |true|; infinite where only the true value is 0.
    """

    case: str
    of: str
    parameter: str
    """Name of the case, id of the effect ("" for a value in the rig file), and the parameter."""
    primary: bool
    """Whether it is the first parameter of the effect in the catalogue, which gives its size."""
    relative: float
    inside: bool
    """Whether the 90 % interval contains the true value."""
    estimate: Estimate
    true: float
    """Estimate with its 90 % interval, and the true value."""


def claims_of(case: ScoredCase) -> tuple[Claim, ...]:
    """Returns a claim for every effect that was named, in the order of the diagnosis."""
    truth = () if case.answer.kind == "open" else case.answer.effects
    return tuple(
        Claim(effect.probability, is_true(effect.id, truth)) for effect in case.findings.named
    )


def reliability(claims: Sequence[Claim]) -> Reliability:
    """Computes the reliability; bins of `EDGES` contain their lower end, the last one both ends."""
    if not claims:
        return Reliability((), 0, math.nan, math.nan, math.nan)
    p = np.array([claim.probability for claim in claims])
    true = np.array([claim.true for claim in claims], dtype=np.float64)
    place = np.clip(np.searchsorted(EDGES, p, side="right") - 1, 0, len(EDGES) - 2)
    bins, error = [], 0.0
    for number in np.unique(place):
        inside = place == number
        words = f"{EDGES[number]:g} to {EDGES[number + 1]:g}"
        bins.append(Bin(float(p[inside].mean()), share(words, map(bool, true[inside]))))
        error += float(inside.mean()) * abs(bins[-1].probability - bins[-1].true.value)
    rate = float(true.mean())
    return Reliability(
        tuple(bins), len(claims), float(np.mean((p - true) ** 2)), rate * (1.0 - rate), error
    )


def risk_curve(cases: Sequence[ScoredCase]) -> tuple[RiskPoint, ...]:
    """Returns the curve by falling probability, one point for each (El-Yaniv, Wiener, 2010).

    Cases of every kind count: a name in a machine without effects is wrong, and cases in which
    nothing was named keep the coverage below 1. Names of the same probability share one point.
    """
    firsts = [claims_of(case)[0] for case in cases if case.findings.named]
    points = []
    for threshold in sorted({claim.probability for claim in firsts}, reverse=True):
        kept = [not claim.true for claim in firsts if claim.probability >= threshold]
        wrong = share(f"named with {threshold:.2f} and above", kept)
        points.append(RiskPoint(threshold, len(kept) / len(cases), wrong))
    return tuple(points)


def effect_errors(cases: Sequence[ScoredCase]) -> tuple[SizeError, ...]:
    """Returns the errors of all parameters of the named effects whose id is that of a true one."""
    return tuple(error for case in cases for error in _of_effects(case))


def rig_errors(cases: Sequence[ScoredCase]) -> tuple[SizeError, ...]:
    """Returns the errors of the calibrated values in the rig file.

    Two groups are left out: machines with an effect outside of the catalogue, whose values mean
    something else, and nuisances, which have no true value.
    """
    return tuple(
        _error(case.name, "", name, True, estimate, case.answer.true[name])
        for case in cases
        if case.answer.kind != "open"
        for name, estimate in case.findings.calibration.items()
        if name in case.answer.true and math.isfinite(estimate.value)
    )


def _of_effects(case: ScoredCase) -> Iterator[SizeError]:
    catalogue = effects()
    for effect in case.findings.named:
        true = case.answer.effects.get(effect.id, {})
        for name, estimate in effect.sizes.items():
            if name in true and math.isfinite(estimate.value):
                known = effect.id in catalogue
                primary = known and catalogue[effect.id].parameters[0].name == name
                yield _error(case.name, effect.id, name, primary, estimate, true[name])


def _error(
    case: str, of: str, name: str, primary: bool, estimate: Estimate, true: float
) -> SizeError:
    off = abs(estimate.value - true)
    relative = off / abs(true) if true else (math.inf if off else 0.0)
    inside = estimate.low <= true <= estimate.high
    return SizeError(case, of, name, primary, relative, inside, estimate, true)
