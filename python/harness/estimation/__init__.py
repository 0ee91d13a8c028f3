# SPDX-License-Identifier: MIT
"""Replays records through the C++ estimator."""

from ehsid.harness.estimation.many import estimate_all
from ehsid.harness.estimation.recursion import Recursion, scaling_of
from ehsid.harness.estimation.replay import estimate
from ehsid.harness.estimation.result import Estimate, EstimationResult
from ehsid.harness.estimation.spread import (
    Coefficient,
    Estimates,
    Named,
    Outlier,
    RecordEstimate,
    compare,
)

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
