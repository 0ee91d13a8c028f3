# SPDX-License-Identifier: MIT
"""Replays records through the C++ estimator."""

from .many import estimate_all
from .recursion import Recursion, scaling_of
from .replay import estimate
from .result import Estimate, EstimationResult
from .spread import Coefficient, Estimates, Named, Outlier, RecordEstimate, compare

__all__ = [
    "Coefficient",
    "Estimate",
    "Estimates",
    "EstimationResult",
    "Named",
    "Outlier",
    "RecordEstimate",
    "Recursion",
    "compare",
    "estimate",
    "estimate_all",
    "scaling_of",
]
