# SPDX-License-Identifier: MIT
"""Replays records through the C++ estimator."""

from ehsid.harness.estimation.replay import EstimationResult, estimate, scaling_of

__all__ = ["EstimationResult", "estimate", "scaling_of"]
