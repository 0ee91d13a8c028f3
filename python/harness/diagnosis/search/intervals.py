# SPDX-License-Identifier: MIT
"""Confidence intervals of fitted values, from the gradients of the cost in each window.

Errors are correlated within a window, but hardly between windows. The covariance is the sandwich
H^-1 (sum_w g_w g_w' + Lambda) H^-1 (H. White, Econometrica 50(1), 1982), with g_w the gradient of a
window, H the Gauss-Newton Hessian and Lambda the information of the priors. Structured errors
therefore count as often as they are independent, whatever the cost assumes.

Least sizes of effects: what is smaller is part of every servo and is not reported.

Fitted values that ended at an end of their range, and so are not values to trust.

Gain of a candidate over another on held-out records.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from ...base.numbers import FloatArray
from ...catalogue.parameters import effects
from ...catalogue.spellings import ParameterKey, sizes_of
from ...rigs import Rig
from ..model.case import Case
from ..model.parameters import Parameter
from ..model.problem import Problem
from ..model.scale import machine_scale
from ..schema import Estimate
from .candidates import FittedCandidate, decision_case

LEVEL = 0.9


def covariance(problem: Problem, x: FloatArray, *, at_ends: bool = False) -> FloatArray:
    """Covariance of the parameters x, shape (n, n).

    The variance is zero where a bound holds a parameter, and infinite where nothing depends on it.

    at_ends: that of parameters at a bound, too, as if it did not hold them.
    """
    step, gradients = problem.window_gradients(x)
    # A parameter that the data push against its bound does not move with them.
    at_bound = ((x <= problem.low) & (step.gradient > 0.0)) | (
        (x >= problem.high) & (step.gradient < 0.0)
    )
    if at_ends:
        at_bound = problem.low == problem.high
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


def candidate_covariance(
    case: Case, candidate: FittedCandidate, *, at_ends: bool = False
) -> tuple[FloatArray, int]:
    """Returns the covariance of the x of a candidate, shape (n, n), and the number of windows used.

    at_ends: as of `covariance`.
    """
    problem = decision_case(case).problem(candidate.effects, laws=candidate.laws)
    windows = sum(int(np.unique(record.window[record.used]).size) for record in problem.records)
    return covariance(problem, candidate.x, at_ends=at_ends), windows


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


# Distances by which intervals of 90 % had to be wider to hold on 1,000 generated machines, as
# shares of the size, at the low and the high end, with pressures (True) and with the position
# alone (False); see docs/gap/calibration.md. Gradients over windows tell how much a figure scatters
# on one machine, not by how much machines differ from the simulator (Y. Romano, E. Patterson, E.
# Candès, Conformalized quantile regression, NeurIPS 2019); `ehsid gap-calibrate` computes them.
SIZE_FURTHER = {True: (0.039, 0.014), False: (0.105, 0.033)}


def size_between_machines(estimate: Estimate, parameter: Parameter, pressures: bool) -> Estimate:
    """Returns the estimate of a parameter of an effect with an interval that holds on any machine.

    The ends stay within the bounds of the parameter. Other parameters stay as they are.
    """
    if ParameterKey(parameter.name).effect is None:
        return estimate
    size = abs(estimate.value)
    low, high = (size * distance for distance in SIZE_FURTHER[pressures])
    ends = parameter.value(parameter.low), parameter.value(parameter.high)
    return Estimate(
        estimate.value,
        max(estimate.low - low, min(ends)),
        min(estimate.high + high, max(ends)),
    )


def in_deviations(parameter: Parameter, x: float, deviation: float) -> tuple[float, float]:
    """Distance of x from the centre of its prior, in deviations of the prior, and of the fit."""
    distance = abs(x - parameter.centre)
    prior_deviations = distance / parameter.sigma if math.isfinite(parameter.sigma) else math.inf
    return prior_deviations, distance / deviation if deviation > 0.0 else math.inf


# Accuracy of a margin: it weighs a few nats, of which a hundredth is nothing.
MARGIN_STEP = 0.01
# Parts of what an effect has beyond a simpler one, of which one is of a usual size if the whole is
# too large. They are only looked at for the words of a reason.
PARTS = tuple(0.01 * k for k in range(1, 100))


def matters(effect: str, values: Mapping[str, float], rig: Rig) -> bool:
    """Whether an effect is larger than what every servo has without it.

    `EffectInfo.least_size` gives the reason for the least size.

    Parameters
    ----------
    effect
        id of the effect.
    values
        fitted values, by full name.
    rig
        the rig whose pressures, areas and flows set the scale.
    """
    return effects()[effect].matters(sizes_of(effect, values), machine_scale(rig))


def simpler_part(effect: str, values: Mapping[str, float], rig: Rig) -> str | None:
    """Returns the simpler effect that an effect contains, if this part alone matters; else None."""
    info = effects()[effect]
    if info.contains is None:
        return None
    simple = info.simplified(sizes_of(effect, values))
    return info.contains if effects()[info.contains].matters(simple, machine_scale(rig)) else None


def too_large(effect: str, values: Mapping[str, float], rig: Rig) -> bool:
    """Whether an effect has more of its own than any servo has, and so does not matter.

    Then a part of what it has beyond the simpler effect that it contains would matter.
    """
    info, scale = effects()[effect], machine_scale(rig)
    sizes = sizes_of(effect, values)
    if info.contains is None or info.matters(sizes, scale):
        return False
    same = info.same(info.simplified(sizes))
    return any(
        info.matters(
            {name: same[name] + part * (size - same[name]) for name, size in sizes.items()}, scale
        )
        for part in PARTS
    )


def largest_usual(effect: str, values: Mapping[str, float], rig: Rig) -> dict[str, float]:
    """Returns the largest size of one parameter, by full name, with which the effect matters.

    It is the parameter that has to become smaller by the least factor; empty where none is enough.

    effect, values, rig: as in `matters`; the effect is too large.
    """
    info, scale = effects()[effect], machine_scale(rig)
    sizes = sizes_of(effect, values)
    for part in reversed(PARTS):
        for name, size in sizes.items():
            if info.matters({**sizes, name: part * size}, scale):
                return {ParameterKey.of_effect(effect, name): part * size}
    return {}


def margin(effect: str, values: Mapping[str, float], rig: Rig) -> float:
    """Returns ln of the factor by which an effect exceeds its least size, 0 to 1.

    The effect is made smaller, each parameter with the power by which the outputs depend on it,
    until it no longer matters. From a factor of e on, the margin is 1.

    Parameters
    ----------
    effect, values, rig
        as in `matters`; the effect matters.
    """
    info, scale = effects()[effect], machine_scale(rig)
    sizes = sizes_of(effect, values)

    def still_matters(smaller: float) -> bool:
        return info.matters(scaled(effect, sizes, -smaller), scale)

    if still_matters(1.0):
        return 1.0
    low, high = 0.0, 1.0
    while high - low > MARGIN_STEP:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if still_matters(middle) else (low, middle)
    return low


def scaled(effect: str, sizes: Mapping[str, float], factor: float) -> dict[str, float]:
    """Sizes of an effect, each with the power by which the outputs depend on it; factor as ln."""
    return {
        p.name: p.neutral + (sizes[p.name] - p.neutral) * math.exp(factor * p.power)
        for p in effects()[effect].parameters
    }


# A fitted value is at an end of its range where less than a thousandth of the range is left.
AT_BOUND = 1e-3


@dataclass(frozen=True)
class AtBound:
    """A fitted value at an end of its range."""

    key: ParameterKey
    """Full name of the value."""
    value: float
    """Where the fit ended."""
    end: str
    """"lower" or "upper"."""

    @property
    def told(self) -> str:
        """Name, value and end; "of" and the range follow."""
        return f"{self.key} = {self.value:.4g} is at the {self.end} end"


def values_at_bounds(case: Case, best: FittedCandidate) -> tuple[AtBound, ...]:
    """Returns the values of the rig and of the effects that are at an end; nuisances are none."""
    found = []
    for parameter, x in zip(case.parameters(best.effects), best.x, strict=False):
        key = ParameterKey(parameter.name)
        span = parameter.high - parameter.low
        if key.is_nuisance or not 0.0 < span < math.inf:
            continue
        near = AT_BOUND * span
        if parameter.low + near < x < parameter.high - near:
            continue
        end = "lower" if x <= parameter.low + near else "upper"
        found.append(AtBound(key, parameter.value(float(x)), end))
    return tuple(found)


@dataclass(frozen=True)
class LikelihoodGain:
    """Gain in log-likelihood of a candidate over a reference candidate."""

    nats: float
    """Held-out log-likelihood of the candidate minus that of the reference, nats."""
    relative: float
    """ln(errors of the reference / errors of the candidate), noise floor included, mean over the
    outputs: 0.1 is 10 %."""


def likelihood_gain(
    case: Case, candidate: FittedCandidate, reference: FittedCandidate
) -> LikelihoodGain:
    """Returns the gain of `candidate` over `reference`.

    The log-likelihood is that of the fits, see `model.likelihood`.
    """
    return LikelihoodGain(
        reference.held_out_cost - candidate.held_out_cost,
        _log_errors(case, reference) - _log_errors(case, candidate),
    )


def above_floor(case: Case, candidate: FittedCandidate) -> float:
    """Returns ln of the held-out errors over the noise floor, mean over the outputs.

    The floor is added in quadrature to both, so that a candidate whose errors are noise has 0.
    """
    floors = np.array([case.floors[name].value for name in case.outputs])
    return _log_errors(case, candidate) - float(np.log(floors * np.sqrt(2.0)).mean())


def _log_errors(case: Case, candidate: FittedCandidate) -> float:
    """Returns ln sqrt(mse + floor^2), mean over the outputs."""
    floors = np.array([case.floors[name].value for name in case.outputs])
    mse = candidate.squares.sum(axis=0) / candidate.counts.sum()
    return float(0.5 * np.log(mse + floors**2).mean())
