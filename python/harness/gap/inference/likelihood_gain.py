# SPDX-License-Identifier: MIT
"""Gain in log-likelihood of a candidate over another on held-out records, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.data.bootstrap import drawn_counts
from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.thresholds import BOOTSTRAP_SEED


@dataclass(frozen=True)
class LikelihoodGain:
    """Gain in log-likelihood of a candidate over a reference candidate.

    Attributes
    ----------
    nats
        held-out log-likelihood of the candidate minus that of the reference, nats.
    low
        the level of `nats` that 95 % of the bootstrap draws of windows exceed.
    relative
        ln(errors of the reference / errors of the candidate), noise floor included, mean over the
        outputs: 0.1 is 10 %.
    """

    nats: float
    low: float
    relative: float


def _log_errors(case: Case, candidate: FittedCandidate, weights: FloatArray) -> FloatArray:
    """Returns ln sqrt(mse + floor^2), mean over the outputs, shape (draws,).

    weights: how often each draw takes each window, shape (draws, W).
    """
    floors = np.array([case.floors[name].value for name in case.outputs])
    mse = (weights @ candidate.squares) / (weights @ candidate.counts)[:, np.newaxis]
    return np.asarray(0.5 * np.log(mse + floors**2).mean(axis=1), dtype=np.float64)


def likelihood_gain(
    case: Case, candidate: FittedCandidate, reference: FittedCandidate
) -> LikelihoodGain:
    """Returns the gain of `candidate` over `reference`, with a bootstrap over windows.

    Windows are drawn with replacement, the same windows for both candidates. The log-likelihood is
    that of the fits, see `model.likelihood`.
    """
    windows = candidate.counts.size
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    weights = np.vstack([np.ones(windows), drawn_counts(windows, rng)]).astype(np.float64)
    relative = _log_errors(case, reference, weights) - _log_errors(case, candidate, weights)
    nats = _costs(case, reference, weights) - _costs(case, candidate, weights)
    return LikelihoodGain(float(nats[0]), float(np.quantile(nats[1:], 0.05)), float(relative[0]))


def _costs(case: Case, candidate: FittedCandidate, weights: FloatArray) -> FloatArray:
    """Negative log-likelihood of the held-out windows for each draw, shape (draws,)."""
    # A window at the end of a record that is shorter than the others has no coefficients.
    powers = candidate.powers
    weights = weights[:, : powers.shape[0]]
    sums = np.tensordot(weights, powers, axes=1) / np.mean(weights, axis=1)[:, None, None]
    total = np.zeros(weights.shape[0])
    for index, likelihood in enumerate(case.problem(held_out=True).likelihoods.values()):
        mean = sums[:, index] / np.maximum(likelihood.spectrum.sizes, 1.0)
        total += 0.5 * np.log(mean + likelihood.tolerated) @ likelihood.counts
    return total


def above_floor(case: Case, candidate: FittedCandidate) -> float:
    """Returns ln of the held-out errors over the noise floor, mean over the outputs.

    The floor is added in quadrature to both, so that a candidate whose errors are noise has 0.
    """
    floors = np.array([case.floors[name].value for name in case.outputs])
    weights = np.ones((1, candidate.counts.size))
    return float(_log_errors(case, candidate, weights)[0] - np.log(floors * np.sqrt(2.0)).mean())
