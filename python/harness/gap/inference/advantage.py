# SPDX-License-Identifier: MIT
"""How much better one rival is than another on held-out data, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.inference.rivals import Rival
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.thresholds import BOOTSTRAP_DRAWS, BOOTSTRAP_SEED, INDEPENDENT_HZ


@dataclass(frozen=True)
class Advantage:
    """Of one rival over another.

    Attributes
    ----------
    nats
        of held-out log-likelihood.
    low
        the level that 95 % of the draws of windows exceed.
    relative
        ln of the ratio of their errors with the floor, mean over the outputs: 0.1 is 10 %.
    """

    nats: float
    low: float
    relative: float


def _log_errors(case: Case, rival: Rival, weights: FloatArray) -> FloatArray:
    """Errors as ln sqrt(mse + floor^2), mean over outputs; weights (draws, W)."""
    floors = np.array([case.floors[name].value for name in case.outputs])
    mse = (weights @ rival.squares) / (weights @ rival.counts)[:, np.newaxis]
    return np.asarray(0.5 * np.log(mse + floors**2).mean(axis=1), dtype=np.float64)


def advantage(case: Case, better: Rival, worse: Rival) -> Advantage:
    """Of `better` over `worse`; windows are drawn with replacement, the same for both.

    nats = outputs n (mean over outputs of ln e_worse - ln e_better), n the independent errors.
    """
    windows = better.counts.size
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    drawn = rng.multinomial(windows, np.full(windows, 1.0 / windows), size=BOOTSTRAP_DRAWS)
    weights = np.vstack([np.ones(windows), drawn]).astype(np.float64)
    relative = _log_errors(case, worse, weights) - _log_errors(case, better, weights)
    assert case.records[0].dt_s is not None
    independent = INDEPENDENT_HZ * float(better.counts.sum()) * case.records[0].dt_s
    nats = relative * independent * len(case.outputs)
    return Advantage(float(nats[0]), float(np.quantile(nats[1:], 0.05)), float(relative[0]))


def above_floor(case: Case, rival: Rival) -> float:
    """Held-out errors over the floor, both with the floor: ln of the ratio, mean over the outputs.

    A rival at the floor has 0: its errors are noise.
    """
    floors = np.array([case.floors[name].value for name in case.outputs])
    weights = np.ones((1, rival.counts.size))
    return float(_log_errors(case, rival, weights)[0] - np.log(floors * np.sqrt(2.0)).mean())
