# SPDX-License-Identifier: MIT
"""Replays records through the C++ estimator."""

from .many import estimate, estimate_all
from .recursion import Estimate, EstimationResult, Recursion, scaling_of
from .spread import Coefficient, Estimates, Named, compare

__all__ = [
    "Coefficient",
    "Estimate",
    "Estimates",
    "EstimationResult",
    "Named",
    "Recursion",
    "compare",
    "estimate",
    "estimate_all",
    "scaling_of",
]
