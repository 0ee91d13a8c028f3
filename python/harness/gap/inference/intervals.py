# SPDX-License-Identifier: MIT
"""Intervals of fitted values from windows, whose errors hang together within but hardly between.

The sandwich H^-1 (sum_w g_w g_w' + Lambda) H^-1 (H. White, Econometrica 50(1), 1982), with g_w the
gradient of a window, H the Gauss-Newton Hessian and Lambda the information of the priors: errors
that are structured count as often as they are independent, whatever the cost assumes.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import t as student

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.inference.rivals import Rival, decisive
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.parameters import Parameter
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.schema import Estimate

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


def scatter_of(case: Case, rival: Rival) -> tuple[FloatArray, int]:
    """Deviation of each x of a rival, and the number of windows it rests on.

    Nuisances that were left out, for nothing of the record tells them from an effect, are as
    uncertain as their priors are: so is what stands for them.
    """
    problem = decisive(case).problem(rival.effects, unseen=True)
    names = {one.name for one in case.parameters(rival.effects)}
    places = [i for i, one in enumerate(problem.parameters) if one.name in names]
    full = problem.centre()
    full[places] = rival.x
    windows = sum(int(np.unique(one.window[one.used]).size) for one in problem.records)
    return deviations(problem, full)[places], windows


def interval(
    parameter: Parameter, x: float, deviation: float, windows: int, model_error: float = 0.0
) -> Estimate:
    """Value and interval of 90 % with Student's t of the windows, inside the bounds.

    model_error: deviation of the value, relative, by which the simulator is no machine.
    """
    model = model_error * (1.0 if parameter.logarithmic else abs(x))
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
