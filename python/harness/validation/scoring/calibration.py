# SPDX-License-Identifier: MIT
"""Calibration of `probability`: of all effects named with 0.9, nine in ten should be true."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.validation.scoring.figures import Figure, share
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.right import is_true

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
    """How well the probabilities of the named effects agree with the share that is true.

    Attributes
    ----------
    bins
        bins that contain claims, by rising probability.
    claims
        number of all effects named.
    brier
        mean of (p - true)^2 (G. W. Brier, Monthly Weather Review 78(1), 1950); 0 is best.
    brier_constant
        Brier score of a constant p, the share that is true; a higher `brier` is worse than none.
    expected_error
        sum over bins of their share of the claims times |mean probability - share true|.
    """

    bins: tuple[Bin, ...]
    claims: int
    brier: float
    brier_constant: float
    expected_error: float


def claims_of(cases: Sequence[Scored]) -> list[Claim]:
    """Returns a claim for every effect that was named, in cases of every kind."""
    return [
        Claim(named.probability, case.answer.kind != "open" and is_true(named.id, truth))
        for case in cases
        for truth in [case.answer.effects]
        for named in case.said.named
    ]


def reliability(claims: Sequence[Claim]) -> Reliability:
    """Computes the reliability; bins of `EDGES` contain their lower end, the last one both ends."""
    if not claims:
        return Reliability((), 0, math.nan, math.nan, math.nan)
    p = np.array([claim.probability for claim in claims])
    true = np.array([claim.true for claim in claims], dtype=np.float64)
    place = np.clip(np.searchsorted(EDGES, p, side="right") - 1, 0, len(EDGES) - 2)
    bins, error = [], 0.0
    for number in range(len(EDGES) - 1):
        inside = place == number
        if not inside.any():
            continue
        words = f"{EDGES[number]:g} to {EDGES[number + 1]:g}"
        found = Bin(float(p[inside].mean()), share(words, [bool(t) for t in true[inside]]))
        bins.append(found)
        error += float(inside.mean()) * abs(found.probability - found.true.value)
    rate = float(true.mean())
    return Reliability(
        tuple(bins), len(claims), float(np.mean((p - true) ** 2)), rate * (1.0 - rate), error
    )
