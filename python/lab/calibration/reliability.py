# SPDX-License-Identifier: MIT
"""Whether probabilities are meant: the expected calibration error, and what chance makes of it.

    ECE = sum_b (n_b / n) |mean probability in bin b - share true in bin b|

over bins with equal numbers of claims (M. P. Naeini et al., AAAI 2015). It is above zero for meant
probabilities, too, because shares of few claims scatter. So outcomes are drawn from the
probabilities themselves, and their ECE stands beside it (J. Bröcker, L. A. Smith, Weather and
Forecasting 22(3), 2007).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.numbers import FloatArray

from ..scoring.figures import LEVEL, Bin, Figure, Range, share
from .choices import BoolArray, IntArray
from .fitting import Ranked

# Largest error that is wanted.
TARGET = Range(most=0.03)
# The usual number of bins, and the least number of claims in one: the share true of fewer has a
# standard error of more than a tenth.
BINS, LEAST_CLAIMS = 10, 20
# Percentiles of so many resamples have a relative error of a few per cent.
RESAMPLES = 1000
SEED = 1


@dataclass(frozen=True, eq=False)
class Claims:
    """n probabilities, whether what they are of is true, and the number of the machine of each."""

    chances: FloatArray
    true: BoolArray
    machines: IntArray


@dataclass(frozen=True)
class Reliability:
    """How well probabilities agree with what is true."""

    words: str
    """What the probabilities are of."""
    bins: tuple[Bin, ...]
    """Bins with equal numbers of claims, by rising probability."""
    error: Figure
    """Expected calibration error, with the interval of a bootstrap over the machines."""
    meant: float
    """Expected calibration error of outcomes drawn from the probabilities, mean."""
    meant_most: float
    """Its 95th percentile; an error above it is not chance."""


def first_answers(each: Sequence[Ranked]) -> Claims:
    """Returns a claim for each machine: the probability of its first answer."""
    return Claims(
        np.array([ranked.chances[0] for ranked in each]),
        np.array([ranked.true[0] for ranked in each], dtype=np.bool_),
        np.arange(len(each)),
    )


def named_effects(each: Sequence[Ranked]) -> Claims:
    """Returns a claim for each effect of the first answers: the probability of the effect."""
    found = [
        (chance, true, number)
        for number, ranked in enumerate(each)
        for chance, true in ranked.effect_chances()
    ]
    chances, true, machines = zip(*found, strict=True) if found else ((), (), ())
    return Claims(
        np.array(chances, dtype=np.float64),
        np.array(true, dtype=np.bool_),
        np.array(machines, dtype=np.int64),
    )


def reliability(words: str, claims: Claims) -> Reliability:
    """Computes bins, error, its interval and its size for meant probabilities; seeded."""
    count = claims.chances.size
    if not count:
        return Reliability(
            words, (), Figure(words, math.nan, math.nan, math.nan, 0, target=TARGET), 0.0, 0.0
        )
    rng = np.random.default_rng(SEED)
    order = np.argsort(claims.chances, kind="stable")
    chances, true = claims.chances[order], claims.true[order]
    _, number = np.unique(claims.machines[order], return_inverse=True)
    machines = int(number.max()) + 1
    errors = np.empty(RESAMPLES)
    for i in range(RESAMPLES):
        # A machine that is drawn twice brings its claims twice.
        times = np.bincount(rng.integers(machines, size=machines), minlength=machines)
        drawn = np.repeat(np.arange(count), times[number])
        errors[i] = expected_error(chances[drawn], true[drawn])
    meant = [expected_error(chances, rng.random(count) < chances) for _ in range(RESAMPLES)]
    value = expected_error(chances, true)
    # Drawing again makes shares scatter once more, so the drawn errors are larger by their mean
    # excess over the value. Their spread around their mean is that of the value.
    ends = np.quantile(errors - errors.mean(), [0.5 - LEVEL / 2.0, 0.5 + LEVEL / 2.0])
    low, high = np.maximum(value + ends, 0.0)
    return Reliability(
        words,
        tuple(
            Bin(float(part.mean()), share(f"{part[0]:.2f} to {part[-1]:.2f}", map(bool, of)))
            for part, of in zip(_bins(chances), _bins(true), strict=True)
        ),
        Figure(words, value, float(low), float(high), count, target=TARGET),
        float(np.mean(meant)),
        float(np.quantile(meant, 0.95)),
    )


def expected_error(chances: FloatArray, true: BoolArray) -> float:
    """Returns the ECE of n > 0 claims; `chances` do not fall."""
    total = sum(
        abs(float(part.sum()) - float(of.sum()))
        for part, of in zip(_bins(chances), _bins(true), strict=True)
    )
    return total / chances.size


def _bins(values: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
    return np.array_split(values, min(BINS, max(1, values.size // LEAST_CLAIMS)))
