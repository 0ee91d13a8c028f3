# SPDX-License-Identifier: MIT
"""Errors that a candidate leaves in all data, on the scale of what is tolerated."""

from __future__ import annotations

import math
import sys
from typing import Literal

import numpy as np

from ..model.case import Case
from ..search.candidates import FittedCandidate

Data = Literal["all", "fitted", "held out"]

# What a simulation that diverges leaves: more than any errors that are finite.
DIVERGED = math.log(sys.float_info.max)


def left(case: Case, candidate: FittedCandidate, data: Data = "all") -> float:
    """Mean of ln(errors / tolerated errors) over all octaves, windows and outputs, >= 0.

        left = sum_b (n_b / 2) ln((P_b + t_b) / t_b) / sum_b n_b

    with the power P_b of the errors in band b, the tolerated power t_b and the number n_b of
    independent coefficients, over all outputs: the negative log-likelihood of `model.likelihood`,
    less that of a perfect simulator, for each independent error. A mean and not a sum, because
    errors of a model repeat. It is DIVERGED where a simulation diverges. data: which records or
    blocks count.
    """
    cost, count = 0.0, 0.0
    for part, powers in (("fitted", candidate.fit_powers), ("held out", candidate.powers)):
        if data not in ("all", part):
            continue
        likelihoods = case.problem(held_out=part == "held out").likelihoods.values()
        sums = powers.sum(axis=0)
        for by_band, likelihood in zip(sums, likelihoods, strict=True):
            mean = by_band / np.maximum(likelihood.spectrum.sizes, 1.0)
            cost += likelihood.cost_of(mean) - likelihood.cost_of(np.zeros_like(mean))
            count += float(likelihood.counts.sum())
    return cost / count if math.isfinite(cost) else DIVERGED
