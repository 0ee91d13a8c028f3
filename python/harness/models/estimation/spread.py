# SPDX-License-Identifier: MIT
"""Compares the estimates of many records: the usual coefficients, and the records far from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.special

from ...base.numbers import FloatArray
from .advice import state_words
from .recursion import Estimate
from .servo import KEYS

# With fewer records there is no telling which of them is usual.
LEAST_RECORDS = 5
# Probability that a folder of equal machines names any outlier at all.
FALSE_ALARM = 0.01
# A normal distribution has its standard deviation at 1.4826 times the median absolute deviation,
# which uses the records as well as the standard deviation of 37 % of them would (Rousseeuw, Croux
# 1993, Alternatives to the median absolute deviation).
MAD_TO_SIGMA, MAD_EFFICIENCY = 1.4826, 0.37
NORMAL_90 = 1.645  # half width of an interval of 90 %, in standard deviations
# Sampling times that differ by more than records allow in themselves are different ones.
SAME_TIME = 0.01


@dataclass(frozen=True)
class RecordEstimate:
    """The estimate of one record."""

    file: str
    """Name of the record."""
    samples: int
    dt_s: float | None
    """Number of samples, and sampling time in seconds; None if the record has no time."""
    estimate: dict[str, Any]
    """What `ehsid estimate` gives for this record alone, with its "reading" where it is a log."""
    warnings: tuple[str, ...]
    """Why the coefficients may not be those of the machine."""

    def interval(self, name: str) -> tuple[float, float, float]:
        """Returns value and ends of the interval of a quantity; NaN where there is none.

        It is of 90 % for K, omega_n and xi, and of 95 % for coefficients.
        """
        if name in KEYS:
            found = (self.estimate["servo"] or {}).get(KEYS[name], {"ci90": None})
            ends = found["ci90"]
        else:
            found = self.estimate["parameters"][name]
            ends = found["ci95"]
        return (math.nan,) * 3 if ends is None else (found["value"], *ends)


@dataclass(frozen=True)
class Coefficient:
    """One quantity over all records that were compared."""

    name: str
    """K, omega_n, xi, a1, b1 and so on."""
    median: float
    """Middle of the records."""
    spread: float
    """Standard deviation between the records, from the median absolute deviation, which outliers
    hardly change."""
    low: float
    high: float
    """5 % and 95 % quantile."""
    standard_deviation: float
    """Median of the standard deviations that the records give themselves. If `spread` is much
    larger, the machines or their working points differ."""


@dataclass(frozen=True)
class Outlier:
    """A coefficient of a record that is far from that of the others."""

    file: str
    coefficient: str
    value: float
    """Which, and what it is."""
    distance: float
    """From the median, in standard deviations: see `distances`."""


@dataclass(frozen=True)
class Estimates:
    """The estimates of a folder of records."""

    na: int
    nb: int
    nk: int
    forgetting: str
    method: str
    """As in the estimate of each record."""
    dt_s: float | None
    """Sampling time of the compared records, s; None if most have no time."""
    compared: int
    """Number of records in `coefficients`: those with this sampling time."""
    limit: float | None
    """Distance above which a coefficient is an outlier: by chance, about one folder in a hundred
    has one. None with fewer than five records, which tell no outlier."""
    coefficients: tuple[Coefficient, ...]
    """K, omega_n and xi where they can be trusted, and the coefficients in the order of the model,
    without its constant term."""
    outliers: tuple[Outlier, ...]
    """The farthest first."""
    records: tuple[RecordEstimate, ...]
    """By name."""
    failed: dict[str, str]
    """Messages of the files that could not be used, by name."""
    schema_version: int = 1


@dataclass(frozen=True, eq=False)
class Named:
    """An estimate with the name and sampling time of its record, and how a log was read."""

    file: str
    dt_s: float | None
    estimate: Estimate
    reading: Mapping[str, Any] | None = None


def compare(named: Sequence[Named], failed: Mapping[str, str]) -> Estimates:
    """Compares estimates of the same structure, at least one.

    A constant term is not compared: it belongs to the working point of its record. Neither is what
    cannot be trusted of a servo.

    Parameters
    ----------
    named
        the estimates.
    failed
        messages of the files without an estimate, by name.
    """
    first = named[0].estimate
    usual = _usual_time(named)
    alike = [one for one in named if _is_same(one.dt_s, usual)]
    known = [_known(one.estimate) for one in alike]
    order = (*KEYS, *first.orders.names)
    names = sorted({name for has in known for name in has}, key=order.index)
    coefficients: list[Coefficient] = []
    outliers: list[Outlier] = []
    for name in names:
        files = [one.file for one, has in zip(alike, known, strict=True) if name in has]
        values, own = np.array([has[name] for has in known if name in has]).T
        median = float(np.median(values))
        spread = MAD_TO_SIGMA * float(np.median(np.abs(values - median)))
        low, high = map(float, np.quantile(values, [0.05, 0.95]))
        middle = float(np.median(own))
        coefficients.append(Coefficient(name, median, spread, low, high, middle))
        limit = distance_limit(len(files), len(names))
        if limit is not None:
            away = distances(values, own, median, spread)
            outliers += [
                Outlier(files[i], name, float(values[i]), float(away[i]))
                for i in np.flatnonzero(away > limit)
            ]
    return Estimates(
        first.orders.na,
        first.orders.nb,
        first.orders.nk,
        first.forgetting,
        first.method,
        usual,
        len(alike),
        distance_limit(len(alike), len(names)),
        tuple(coefficients),
        tuple(sorted(outliers, key=lambda one: -one.distance)),
        tuple(_record(one, usual) for one in named),
        dict(failed),
    )


def _known(estimate: Estimate) -> dict[str, tuple[float, float]]:
    """Returns what is compared of a record, and its standard deviation, by name."""
    orders = estimate.orders
    told = (estimate.theta.tolist(), estimate.standard_deviation.tolist())
    pairs = dict(zip(orders.names[: orders.na + orders.nb], zip(*told, strict=True), strict=False))
    for value in estimate.servo or ():
        if value.trusted:
            pairs[value.name] = (value.path[value.at], value.half_path[value.at] / NORMAL_90)
    return pairs


def distances(
    values: FloatArray, own: FloatArray, median: FloatArray | float, spread: FloatArray | float
) -> FloatArray:
    """Returns how far each coefficient is from the median, in standard deviations.

    The standard deviation is the spread of the records or that of the record itself, whichever is
    larger: a short record is allowed to be farther away. Where the records together lie closer than
    they state for themselves, they all state too much, as they do with coloured residuals; their
    own deviations are then reduced to what the records show. `values` and `own` have the shape
    (records, n), `median` and `spread` (n,); or one dimension less.
    """
    away = np.abs(values - median)
    ratio = np.divide(away, own, out=np.full_like(away, np.inf), where=own > 0.0)
    shown = np.minimum(1.0, MAD_TO_SIGMA * np.median(ratio, axis=0))
    size = np.maximum(spread, shown * own)
    return np.divide(away, size, out=np.where(away > 0.0, np.inf, 0.0), where=size > 0.0)


def distance_limit(records: int, coefficients: int) -> float | None:
    """Returns the distance that is exceeded with probability `FALSE_ALARM` in a folder by chance.

    The two-sided quantile of Student's t for as many comparisons (Bonferroni), with the degrees of
    freedom that the median absolute deviation of so many records has. None for too few records.
    """
    if records < LEAST_RECORDS:
        return None
    freedom = MAD_EFFICIENCY * (records - 1)
    return -float(scipy.special.stdtrit(freedom, FALSE_ALARM / (2 * records * coefficients)))


def _usual_time(named: Sequence[Named]) -> float | None:
    """Returns the sampling time that the largest number of records has."""
    times: list[float | None] = [one.dt_s for one in named]
    return max(times, key=lambda time: sum(_is_same(other, time) for other in times))


def _is_same(time: float | None, other: float | None) -> bool:
    if time is None or other is None:
        return time is other
    return abs(time - other) <= SAME_TIME * other


def _record(one: Named, usual: float | None) -> RecordEstimate:
    plain = one.estimate.to_dict()
    if one.reading is not None:
        plain["reading"] = dict(one.reading)
    return RecordEstimate(
        one.file, one.estimate.n_samples, one.dt_s, plain, tuple(_warnings(one, usual))
    )


def _warnings(one: Named, usual: float | None) -> list[str]:
    estimate, found = one.estimate, []
    if not _is_same(one.dt_s, usual):
        found.append(
            f"sampling time {_time(one.dt_s)} where most records have {_time(usual)}: the "
            "coefficients cannot be compared; --dt resamples all records"
        )
    found += [
        f"{value.name} not trusted ({value.reason.name})"
        for value in estimate.servo or ()
        if not value.trusted
    ]
    if not estimate.converged:
        found.append(state_words(estimate))
    if not estimate.residuals_white:
        found.append(f"residuals not white (statistic {estimate.whiteness:.3g})")
    if estimate.resets:
        found.append(f"{estimate.resets} resets" if estimate.resets > 1 else "1 reset")
    if not np.isfinite(estimate.simulation_fit_percent):
        found.append("the model is unstable")
    return found


def _time(dt_s: float | None) -> str:
    return "unknown" if dt_s is None else f"{dt_s:.6g} s"
