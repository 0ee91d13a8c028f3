# SPDX-License-Identifier: MIT
"""Confidence intervals of fitted values, from the gradients of the cost in each window.

Errors are correlated within a window, but hardly between windows. The covariance is the sandwich
H^-1 (sum_w g_w g_w' + Lambda) H^-1 (H. White, Econometrica 50(1), 1982), with g_w the gradient of a
window, H the Gauss-Newton Hessian and Lambda the information of the priors. Structured errors
therefore count as often as they are independent, whatever the cost assumes.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import t as student

from ...base.arrays import FloatArray
from ..model.case import Case
from ..model.parameters import Parameter
from ..model.problem import Problem
from ..schema import Estimate
from .candidates import FittedCandidate, decision_case

LEVEL = 0.9


def covariance(problem: Problem, x: FloatArray) -> FloatArray:
    """Covariance of the parameters x, shape (n, n).

    The variance is zero where a bound holds a parameter, and infinite where nothing depends on it.
    """
    step, gradients = problem.window_gradients(x)
    # A parameter that the data push against its bound does not move with them.
    at_bound = ((x <= problem.low) & (step.gradient > 0.0)) | (
        (x >= problem.high) & (step.gradient < 0.0)
    )
    unseen = ~at_bound & (np.diag(step.hessian) <= 0.0)
    free = np.flatnonzero(~at_bound & ~unseen)
    hessian = step.hessian[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.diag(hessian))
    inverse = np.linalg.pinv(hessian * np.outer(scale, scale), hermitian=True)
    inverse = inverse * np.outer(scale, scale)
    free_gradients = gradients[:, free]
    meat = free_gradients.T @ free_gradients + np.diag(problem.information()[free])
    result = np.diag(np.where(unseen, np.inf, 0.0))
    result[np.ix_(free, free)] = inverse @ meat @ inverse
    return result


def deviations(problem: Problem, x: FloatArray) -> FloatArray:
    """Standard deviation of each parameter x, shape (n,); see `covariance`."""
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance(problem, x)), 0.0)))


def candidate_covariance(case: Case, candidate: FittedCandidate) -> tuple[FloatArray, int]:
    """Returns the covariance of the x of a candidate, shape (n, n), and the number of windows used.

    The fit leaves out nuisances that the record cannot separate from an effect. Here they are
    included with the uncertainty of their priors, which adds to that of the effect that stands for
    them.
    """
    fine = decision_case(case)
    problem = fine.problem(candidate.effects, unseen=True, laws=candidate.laws)
    fitted = fine.problem(candidate.effects, laws=candidate.laws).parameters
    names = {parameter.name for parameter in fitted}
    indices = [i for i, parameter in enumerate(problem.parameters) if parameter.name in names]
    x = problem.centre()
    x[indices] = candidate.x
    windows = sum(int(np.unique(record.window[record.used]).size) for record in problem.records)
    return covariance(problem, x)[np.ix_(indices, indices)], windows


def candidate_deviations(case: Case, candidate: FittedCandidate) -> tuple[FloatArray, int]:
    """Standard deviation of each x of a candidate; see `candidate_covariance`."""
    of_all, windows = candidate_covariance(case, candidate)
    return np.asarray(np.sqrt(np.maximum(np.diag(of_all), 0.0))), windows


def interval(
    parameter: Parameter, x: float, deviation: float, windows: int, model_error: float = 0.0
) -> Estimate:
    """Returns a fitted value with its 90 % interval, by Student's t, inside the bounds.

    The degrees of freedom are the number of windows less one. model_error: relative standard
    deviation of the value because the simulator is not an exact model of the machine.
    """
    model = model_error * (1.0 if parameter.logarithmic else abs(x))
    spread = math.hypot(deviation, model)
    reach = float(student.ppf(0.5 + 0.5 * LEVEL, max(windows - 1, 1))) * spread
    low, high = max(x - reach, parameter.low), min(x + reach, parameter.high)
    value = parameter.value(x)
    ends = sorted((parameter.value(low), parameter.value(high)))
    return Estimate(value, min(ends[0], value), max(ends[1], value))


def in_deviations(parameter: Parameter, x: float, deviation: float) -> tuple[float, float]:
    """Distance of x from the centre of its prior, in deviations of the prior, and of the fit."""
    distance = abs(x - parameter.centre)
    prior_deviations = distance / parameter.sigma if math.isfinite(parameter.sigma) else math.inf
    return prior_deviations, distance / deviation if deviation > 0.0 else math.inf
