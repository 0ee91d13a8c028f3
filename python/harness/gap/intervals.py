# SPDX-License-Identifier: MIT
"""Intervals of fitted values from windows, whose errors hang together within but hardly between.

The sandwich H^-1 (sum_w g_w g_w' + Lambda) H^-1 (H. White, Econometrica 50(1), 1982), with g_w the
gradient of a window, H the Gauss-Newton Hessian and Lambda the information of the priors: errors
that are structured count as often as they are independent, whatever the cost assumes.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.stats import t as student

from ehsid.harness.gap.findings import Estimate
from ehsid.harness.gap.parameters import Parameter
from ehsid.harness.gap.problem import Problem
from ehsid.harness.gap.thresholds import MODEL_ERROR

FloatArray = npt.NDArray[np.float64]
LEVEL = 0.9


def deviations(problem: Problem, x: FloatArray) -> FloatArray:
    """Standard deviation of each x, shape (n,)."""
    step, gradients = problem.window_gradients(x)
    # Parameters at a bound do not move with the data.
    held = ((x <= problem.low) & (step.gradient > 0.0)) | (
        (x >= problem.high) & (step.gradient < 0.0)
    )
    free = np.flatnonzero(~held)
    hessian = step.hessian[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.diag(hessian))
    inverse = np.linalg.pinv(hessian * np.outer(scale, scale), hermitian=True)
    inverse = inverse * np.outer(scale, scale)
    inside = gradients[:, free]
    meat = inside.T @ inside + np.diag(problem.information()[free])
    found = np.zeros_like(x)
    found[free] = np.sqrt(np.maximum(np.diag(inverse @ meat @ inverse), 0.0))
    return found


def interval(parameter: Parameter, x: float, deviation: float, windows: int) -> Estimate:
    """Value and interval of 90 % with Student's t of the windows, inside the bounds."""
    model = MODEL_ERROR * (1.0 if parameter.logarithmic else abs(x))
    spread = math.hypot(deviation, model)
    reach = float(student.ppf(0.5 + 0.5 * LEVEL, max(windows - 1, 1))) * spread
    low, high = max(x - reach, parameter.low), min(x + reach, parameter.high)
    value = parameter.value(x)
    ends = sorted((parameter.value(low), parameter.value(high)))
    return Estimate(value, min(ends[0], value), max(ends[1], value))


def in_deviations(parameter: Parameter, x: float, deviation: float) -> tuple[float, float]:
    """How far x is from its prior: in deviations told, and of the fit."""
    away = abs(x - parameter.centre)
    told = away / parameter.sigma if math.isfinite(parameter.sigma) else math.inf
    return told, away / deviation if deviation > 0.0 else math.inf
