# SPDX-License-Identifier: MIT
"""Gain of a candidate over another on held-out records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.case import Case
from .candidates import FittedCandidate


@dataclass(frozen=True)
class LikelihoodGain:
    """Gain in log-likelihood of a candidate over a reference candidate.

    Attributes
    ----------
    nats
        held-out log-likelihood of the candidate minus that of the reference, nats.
    relative
        ln(errors of the reference / errors of the candidate), noise floor included, mean over the
        outputs: 0.1 is 10 %.
    """

    nats: float
    relative: float


def likelihood_gain(
    case: Case, candidate: FittedCandidate, reference: FittedCandidate
) -> LikelihoodGain:
    """Returns the gain of `candidate` over `reference`.

    The log-likelihood is that of the fits, see `model.likelihood`.
    """
    return LikelihoodGain(
        reference.held_out_cost - candidate.held_out_cost,
        _log_errors(case, reference) - _log_errors(case, candidate),
    )


def above_floor(case: Case, candidate: FittedCandidate) -> float:
    """Returns ln of the held-out errors over the noise floor, mean over the outputs.

    The floor is added in quadrature to both, so that a candidate whose errors are noise has 0.
    """
    floors = np.array([case.floors[name].value for name in case.outputs])
    return _log_errors(case, candidate) - float(np.log(floors * np.sqrt(2.0)).mean())


def _log_errors(case: Case, candidate: FittedCandidate) -> float:
    """Returns ln sqrt(mse + floor^2), mean over the outputs."""
    floors = np.array([case.floors[name].value for name in case.outputs])
    mse = candidate.squares.sum(axis=0) / candidate.counts.sum()
    return float(0.5 * np.log(mse + floors**2).mean())
