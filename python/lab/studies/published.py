# SPDX-License-Identifier: MIT
"""Figures of the published experiment, for comparison with our results, not as targets.

R. Ghazali, Y. M. Sam, M. F. Rahmat, Zulfatman, "Recursive parameter estimation for discrete-time
model of an electro-hydraulic servo system with varying forgetting factor", International Journal
of Physical Sciences 6(30), 2011, pp. 6829-6842.
"""

from __future__ import annotations

from dataclasses import dataclass

SOURCE = (
    "R. Ghazali, Y. M. Sam, M. F. Rahmat, Zulfatman, Int. J. Physical Sciences 6(30), 2011, "
    "pp. 6829-6842"
)

DT_S = 0.05
"""Sampling time of the experiment in seconds."""

DURATION_S = 100.0
"""Length of its record in seconds; one half is for estimation, the other for validation."""

MODEL_16 = (-2.2390, 1.7820, -0.5427, 0.3850, -0.5810, 0.2954)
"""Eq. (16), the identified model: a1, a2, a3, b1, b2, b3; na = nb = 3, nk = 1."""


@dataclass(frozen=True)
class PublishedOrder:
    """One row of the paper's table of model orders."""

    order: int
    fit_percent: float
    fpe: float
    loss: float


ORDERS = (
    PublishedOrder(2, 91.27, 0.0325882, 0.0323295),
    PublishedOrder(3, 95.48, 0.0230747, 0.0228011),
    PublishedOrder(4, 95.53, 0.0217047, 0.0213629),
    PublishedOrder(5, 95.51, 0.0215606, 0.0211378),
)


@dataclass(frozen=True)
class PublishedRun:
    """One column of the paper's table of recursive estimates: final parameters and RMSE."""

    theta: tuple[float, ...]
    rmse: float


RECURSIVE = {
    "varying": PublishedRun((-2.2553, 1.8098, -0.5545, 0.3753, -0.5660, 0.2878), 0.1817),
    "0.99": PublishedRun((-2.2502, 1.8148, -0.5642, 0.3760, -0.5694, 0.2924), 0.3878),
    "1": PublishedRun((-2.2020, 1.6833, -0.4813, 0.0344, 0.1058, -0.0678), 0.6967),
}
"""Final parameters and RMSE with varying forgetting factor, lambda = 0.99 and lambda = 1."""
