# SPDX-License-Identifier: MIT
"""Changes in the course of a quantity that was estimated from dated logs, with a stated alarm rate.

Log i, taken at the day t_i, gave the estimate y_i with the standard deviation s_i. Between logs the
machine scatters, too, by tau (partial pooling within a machine):

    y_i = X_i b + g z_k(t_i) + e_i,    e_i ~ N(0, s_i^2 + tau^2)

X has a constant, covariates such as the temperature of the oil and, while a growth goes on, the
time. A change is either a step, z_k = 1 from log k on, or a growth, z_k = (t - t_k)+. Each log asks
for the largest likelihood ratio over both kinds and all k (generalised likelihood ratio: A.
Willsky, H. Jones, IEEE Trans. Automatic Control 21(1), 1976),

    D_k = (z' P y)^2 / (z' P z),    P = W - W X (X' W X)^-1 X' W,    W = diag(1 / (s_i^2 + tau^2))

and an alarm is given where it exceeds `threshold`. The chain then begins anew behind the change.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.special import gammainc, gammaincinv
from scipy.stats import norm

from ..base.numbers import FloatArray

# Logs before the first alarm is possible: they tell level and scatter.
BASELINE = 10
# A change must show in so many logs: a single one may be wrong.
LEAST_AFTER = 2
LEVEL = 0.9
# D that a machine on which nothing changes passes once a year, by logs a year (rows) and watched
# quantities (columns), over which it is interpolated: simulated years, in which tau was estimated
# as here (`benchmarks/watch_alarms.py table`).
LOGS_A_YEAR, QUANTITIES = (12, 26, 52, 120, 365), (1, 3, 10, 30)
PASSED_ONCE_A_YEAR = (
    (0.0, 2.5, 9.1, 15.8),
    (4.0, 8.5, 14.4, 21.1),
    (6.3, 10.8, 16.7, 23.8),
    (8.7, 12.9, 18.2, 24.0),
    (11.4, 14.6, 19.4, 24.8),
)
# Share of the differences of neighbours that is left out, the largest ones, and the mean square of
# the others, of normal numbers with a variance of 1: P(3/2, z / 2) / P(1/2, z / 2) at the limit z.
LEFT_OUT = 0.2
_LARGEST_KEPT = float(gammaincinv(0.5, 1.0 - LEFT_OUT))
MEAN_OF_KEPT = float(gammainc(1.5, _LARGEST_KEPT)) / (1.0 - LEFT_OUT)
# Days in a month, for the rates of growth.
MONTH = 365.25 / 12.0


_LIMITS = RegularGridInterpolator(
    (np.log(LOGS_A_YEAR), np.log(QUANTITIES)),
    np.array(PASSED_ONCE_A_YEAR),
    bounds_error=False,
    fill_value=None,
)


@dataclass(frozen=True, eq=False)
class Course:
    """Estimates of a quantity from N logs, oldest first."""

    days: FloatArray
    """(N,): days since the first log, not falling."""
    values: FloatArray
    deviations: FloatArray
    """(N,): estimates, and their standard deviations within a log, > 0, in the same unit."""
    covariates: FloatArray
    """(N, C): what else may move the quantity; no column is constant."""

    def part(self, begin: int, end: int) -> Course:
        """The logs from `begin` to before `end`."""
        here = slice(begin, end)
        return Course(
            self.days[here], self.values[here], self.deviations[here], self.covariates[here]
        )


@dataclass(frozen=True)
class Change:
    """A change of a quantity."""

    kind: Literal["step", "growth"]
    first: int
    """Index of the first log behind the change; of a growth that of its begin."""
    day: float
    days90: tuple[float, float]
    """Day of the change, and the interval that holds it with 90 %, days since the first log."""
    size: float
    size90: tuple[float, float]
    """What changed by the step, or what grows in a month, with its interval of 90 %."""
    noticed: float
    """Day of the log that gave the alarm."""
    statistic: float
    """Largest D."""


def threshold(logs_a_year: float, quantities: int) -> float:
    """D from which an alarm is given: without a change once a year for all quantities together."""
    logs = min(max(logs_a_year, LOGS_A_YEAR[0]), LOGS_A_YEAR[-1])
    at = math.log(logs), math.log(max(quantities, 1))
    return float(_LIMITS(at).item())


def scatter(course: Course) -> float:
    """Standard deviation tau between logs, from differences of neighbours.

    The largest of them are left out: those across a change, and wrong logs.
    """
    if course.values.size < 3:
        return 0.0
    within = course.deviations[1:] ** 2 + course.deviations[:-1] ** 2
    squares = np.diff(course.values) ** 2
    kept = np.argsort(squares)[: math.floor((1.0 - LEFT_OUT) * squares.size)]
    # E[d^2] = 2 tau^2 + s_i^2 + s_j^2, of which the smaller ones have a smaller mean.
    excess = float(np.mean(squares[kept])) / MEAN_OF_KEPT - float(np.mean(within[kept]))
    return math.sqrt(max(0.5 * excess, 0.0))


@dataclass(frozen=True, eq=False)
class Ratios:
    """Likelihood ratios D of a change at each log, for both kinds, and the sizes; shape (2, N)."""

    statistics: FloatArray
    sizes: FloatArray
    deviations: FloatArray
    rest: float
    """Weighted sum of squares without a change."""

    @property
    def largest(self) -> tuple[int, int]:
        """Kind (0: step, 1: growth) and log of the largest D."""
        kind, log = np.unravel_index(int(np.argmax(self.statistics)), self.statistics.shape)
        return int(kind), int(log)


def ratios(course: Course, tau: float, *, growing: bool = False) -> Ratios:
    """Likelihood ratios of a change at each log; 0 where too few logs are before or behind it.

    growing: whether the course has had a slope from its first log on.
    """
    days, count = course.days, course.days.size
    weights = 1.0 / (course.deviations**2 + tau**2)
    columns = [np.ones(count), *course.covariates.T]
    if growing:
        columns.append(days)
    x = np.stack(columns, axis=1)
    information = np.linalg.pinv(x.T @ (weights[:, np.newaxis] * x), hermitian=True)
    residuals = course.values - x @ (information @ (x.T @ (weights * course.values)))

    def behind(terms: FloatArray) -> FloatArray:
        """Sum of the terms from each log on, (N,) or (N, p)."""
        return np.asarray(np.cumsum(terms[::-1], axis=0)[::-1])

    weighted_x = weights[:, np.newaxis] * x
    s_r, s_tr = behind(weights * residuals), behind(weights * days * residuals)
    s_1, s_t, s_tt = (behind(weights * days**power) for power in (0, 1, 2))
    s_x, s_tx = behind(weighted_x), behind(days[:, np.newaxis] * weighted_x)
    step = s_r, s_1, s_x
    # (t - t_k)+ is t - t_k over the logs behind.
    growth = (
        s_tr - days * s_r,
        s_tt - 2.0 * days * s_t + days**2 * s_1,
        s_tx - days[:, np.newaxis] * s_x,
    )
    told = np.arange(count)
    found = []
    # A growth is 0 at the log from which it begins.
    for (of_residuals, of_square, of_x), after in ((step, LEAST_AFTER), (growth, LEAST_AFTER + 1)):
        allowed = (told >= LEAST_AFTER) & (told <= count - after)
        # z' P y = z' W r, and z' P z = z' W z - z' W X (X' W X)^-1 X' W z
        power = of_square - np.einsum("kp,pq,kq->k", of_x, information, of_x)
        usable = allowed & (power > 1e-9 * np.maximum(of_square, 1e-300))
        power = np.where(usable, power, 1.0)
        size = np.where(usable, of_residuals / power, 0.0)
        found.append((size**2 * power * usable, size, np.where(usable, power**-0.5, np.inf)))
    statistics, sizes, deviations = (np.stack(each) for each in zip(*found, strict=True))
    return Ratios(statistics, sizes, deviations, float(np.sum(weights * residuals**2)))


def changes(course: Course, limit: float) -> list[Change]:
    """Returns the changes of a course, oldest first; limit: see `threshold`.

    A first few logs behind a change do not tell a step from a growth. Kind and date of the last
    change are told again with each log, until the next change is found: one that the last change,
    told anew, does not explain as well. A change that later logs do not bear out is withdrawn.
    """
    found: list[Change] = []
    for end in range(BASELINE + 1, course.days.size + 1):
        tau, today = scatter(course.part(0, end)), float(course.days[end - 1])
        last = found.pop() if found else None
        begin = found[-1].first if found else 0
        if last is None:
            first = largest_change(course, begin, end, tau, _grows(found), today)
            if first.statistic >= limit and is_borne_out(course, begin, end, tau, first):
                found.append(first)
            continue
        new: Change | None = None
        grows = last.kind == "growth"
        if end - last.first > 2 * LEAST_AFTER:
            new = largest_change(course, last.first, end, tau, grows, today)
            with_new = (
                ratios(course.part(begin, last.first), tau, growing=_grows(found)).rest
                + ratios(course.part(last.first, end), tau, growing=grows).rest
                - new.statistic
            )
            alone = ratios(course.part(begin, end), tau, growing=_grows(found))
            gain = alone.rest - float(alone.statistics.max()) - with_new
            if min(new.statistic, gain) < limit or not is_borne_out(
                course, last.first, end, tau, new
            ):
                new = None
        # The last log may be the first one of the next change.
        told = max(end - 1, last.first + LEAST_AFTER) if new is None else new.first
        again = largest_change(course, begin, told, tau, _grows(found), last.noticed)
        if again.day > again.noticed:
            again = replace(again, noticed=today)
        if again.statistic >= limit or new is not None:
            found.append(again)
        if new is not None:
            found.append(new)
    return found


def largest_change(
    course: Course, begin: int, end: int, tau: float, growing: bool, noticed: float
) -> Change:
    """The change with the largest ratio among the logs from `begin` to before `end`."""
    here = course.part(begin, end)
    found = ratios(here, tau, growing=growing)
    return _change(here, found, found.largest[0], begin, noticed)


def is_borne_out(course: Course, begin: int, end: int, tau: float, change: Change) -> bool:
    """Whether each of the last logs differs from the level before the change, and not only one."""
    before, behind = course.part(begin, change.first), course.part(end - LEAST_AFTER, end)
    weights = 1.0 / (before.deviations**2 + tau**2)
    level = float(np.sum(weights * before.values) / np.sum(weights))
    beyond = math.copysign(1.0, change.size) * (behind.values - level)
    return bool(np.all(beyond > np.hypot(behind.deviations, tau)))


def _grows(found: list[Change]) -> bool:
    """Whether a growth goes on behind these changes."""
    return bool(found) and found[-1].kind == "growth"


def _change(here: Course, found: Ratios, kind: int, begin: int, noticed: float) -> Change:
    statistics, days = found.statistics[kind], here.days
    log = int(np.argmax(statistics))
    # A date is the more probable before it is looked at, the longer the time without a log was.
    gaps = np.maximum(np.diff(days, prepend=days[0]), 1e-6)
    weights = np.where(statistics > 0.0, np.exp(0.5 * (statistics - statistics[log])), 0.0) * gaps
    weights /= weights.sum()
    shares = np.cumsum(weights)
    low, high = (int(np.searchsorted(shares, q)) for q in (0.5 - LEVEL / 2, 0.5 + LEVEL / 2))
    # A step lies between two logs, and a growth may begin between two of them as well.
    high += kind
    ends = days[max(low - 1, 0)], days[min(high, days.size - 1)]
    # The size of a change depends on its date: the deviation has that of the date, too.
    size, sizes = found.sizes[kind, log], found.sizes[kind]
    variances = np.where(weights > 0.0, found.deviations[kind], 0.0) ** 2
    deviation = math.sqrt(float(np.sum(weights * (variances + (sizes - size) ** 2))))
    if kind == 1:
        # A growth begins anywhere between the neighbours, and the slope of a line of the length T
        # moves by 3/2 of its end over T.
        apart = float(days[log + 1] - days[log - 1]) / math.sqrt(12.0)
        deviation = math.hypot(deviation, 1.5 * size * apart / float(days[-1] - days[log]))
    unit = 1.0 if kind == 0 else MONTH
    reach = float(norm.ppf(0.5 + LEVEL / 2)) * deviation
    return Change(
        "step" if kind == 0 else "growth",
        begin + log,
        float(0.5 * (days[log - 1] + days[log]) if kind == 0 else days[log]),
        (float(ends[0]), float(ends[1])),
        float(unit * size),
        (float(unit * (size - reach)), float(unit * (size + reach))),
        noticed,
        float(statistics[log]),
    )


@dataclass(frozen=True, eq=False)
class Levels:
    """The course as it is believed, log by log, (N,) each."""

    mean: FloatArray
    deviation: FloatArray
    """Each log pooled with the others of its segment."""
    seen: FloatArray
    """Step that two logs like this one would have shown in nine of ten cases."""


def levels(course: Course, found: list[Change], limit: float) -> Levels:
    """Returns what the logs of each segment tell together."""
    tau = scatter(course)
    cuts = [0, *(change.first for change in found), course.days.size]
    slopes = [False, *(change.kind == "growth" for change in found)]
    mean, deviation, seen = (np.empty(course.days.size) for _ in range(3))
    for (begin, end), growing in zip(itertools.pairwise(cuts), slopes, strict=True):
        if end == begin:
            continue
        here = course.part(begin, end)
        weights = 1.0 / (here.deviations**2 + tau**2)
        columns = [np.ones(end - begin), *here.covariates.T]
        if growing and end - begin > 2:
            columns.append(here.days)
        x = np.stack(columns, axis=1)
        information = np.linalg.pinv(x.T @ (weights[:, np.newaxis] * x), hermitian=True)
        line = x @ (information @ (x.T @ (weights * here.values)))
        of_line = np.einsum("kp,pq,kq->k", x, information, x)
        # m_i = line + tau^2 / (tau^2 + s_i^2) (y_i - line)
        share = tau**2 * weights
        mean[begin:end] = line + share * (here.values - line)
        deviation[begin:end] = np.sqrt(share * here.deviations**2 + (1.0 - share) ** 2 * of_line)
        seen[begin:end] = (math.sqrt(limit) + norm.ppf(0.9)) * np.sqrt(
            of_line + 1.0 / (2.0 * weights)
        )
    return Levels(mean, deviation, seen)
