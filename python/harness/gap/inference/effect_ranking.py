# SPDX-License-Identifier: MIT
"""Ranking of the effects by the share of the residuals of equations that they remove; no verdict.

Every effect is put into the equations at several sizes. The change of the residuals is a regressor
(a column). All equations share its factor, and each adjusts its own values along with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.keys import effect_values, sizes_of
from ehsid.harness.catalogue.parameters import acts_on, effects
from ehsid.harness.gap.inference.trials import scaled
from ehsid.harness.gap.model.equations import Equation
from ehsid.harness.gap.model.machine import machine_scale
from ehsid.harness.gap.model.weak_form import regress
from ehsid.harness.gap.thresholds import GAIN_DEVIATIONS, WEIGHT_ITERATIONS
from ehsid.harness.parallel import run_together
from ehsid.harness.rigs import Rig


@dataclass(frozen=True)
class RankedEffect:
    """Effect that would reduce the residuals of the equations.

    Attributes
    ----------
    effect
        id of the effect.
    values
        approximate values of its parameters, by full name.
    gain
        sum over the equations of ln(rms before / rms after), nats per independent statistic; zero
        where it may be due to chance.
    deviations
        the gain over its standard deviation, from its scatter over windows of half a second.
    """

    effect: str
    values: Mapping[str, float]
    gain: float
    deviations: float


@dataclass(frozen=True, eq=False)
class _Trial:
    factors: FloatArray
    gain: float
    deviations: float


# Function from the parameters of an effect, by full name, to the residual rows of each equation
# with this effect added.
Change = Callable[[Mapping[str, float]], Mapping[str, FloatArray]]


def rank_effects(
    equations: Sequence[Equation], change: Change, rig: Rig, exclude: Sequence[str] = ()
) -> tuple[RankedEffect, ...]:
    """Returns the effects that the rig file does not contain, largest gain first.

    Parameters
    ----------
    equations
        equations without the effects.
    change
        gives the residual rows with an effect; where these are not finite, it is left out.
    rig
        the rig as configured.
    exclude
        ids of effects that are not tried.
    """
    if not equations:
        return ()
    regressed = _Regressed.of(equations)
    skipped = {*rig.effects(), *exclude}
    tasks = [
        partial(_rank, effect, regressed, change, rig)
        for effect, info in effects().items()
        if effect not in skipped and acts_on(info, rig.plant)
    ]
    ranked = [ranked_effect for ranked_effect in run_together(tasks) if ranked_effect is not None]
    return tuple(sorted(ranked, key=lambda ranked_effect: -ranked_effect.gain))


@dataclass(frozen=True, eq=False)
class _Regressed:
    """Equations after their own regression, which all trials share; the mappings are by name.

    Attributes
    ----------
    base
        residual rows in the unit of the equation, shape (K,).
    start
        moves of the equation's own values, shape (n,).
    rows
        rows after these moves, shape (K,).
    penalties
        penalty of the prior for these moves.
    grams
        shape (n, n), columns' products with the weights of the prior added.
    """

    equations: Sequence[Equation]
    base: Mapping[str, FloatArray]
    start: Mapping[str, FloatArray]
    rows: Mapping[str, FloatArray]
    penalties: Mapping[str, float]
    grams: Mapping[str, FloatArray]

    @classmethod
    def of(cls, equations: Sequence[Equation]) -> _Regressed:
        # The bounds of the prior are left out: a value that has moved to a bound in place of the
        # effect would stay there.
        start = {e.name: regress(e.rows, e.columns, e.centre, e.weight) for e in equations}
        return cls(
            equations,
            {e.name: e.rows * e.sigma for e in equations},
            start,
            {e.name: e.rows + e.columns @ start[e.name] for e in equations},
            {e.name: _prior_penalty(e, start[e.name]) for e in equations},
            {e.name: e.columns.T @ e.columns + np.diag(e.weight) for e in equations},
        )


def _rank(effect: str, regressed: _Regressed, change: Change, rig: Rig) -> RankedEffect | None:
    """Returns the best trial of an effect; None where no trial can be used."""
    info = effects()[effect]
    trials = [
        _estimate(effect, columns, regressed, change) for columns in info.trials(machine_scale(rig))
    ]
    best = max(filter(None, trials), key=lambda trial: trial.gain, default=None)
    if best is not None and info.retried and best.gain > 0.0:
        # Try once more at the estimated size: residuals need not be in proportion to it.
        second = _estimate(effect, [sizes_of(effect, best.values)], regressed, change)
        best = second if second is not None and second.gain > best.gain else best
    return best


def _estimate(
    effect: str,
    columns: Sequence[Mapping[str, float]],
    regressed: _Regressed,
    change: Change,
) -> RankedEffect | None:
    """Estimates the size and the gain of an effect from its columns.

    None where residuals are not finite, or a parameter leaves its range, as with the other sign.
    """
    changed = [change(effect_values(effect, column)) for column in columns]
    signature = {
        equation.name: np.column_stack(
            [
                (rows[equation.name] - regressed.base[equation.name]) / equation.sigma
                for rows in changed
            ]
        )
        for equation in regressed.equations
    }
    if not all(np.isfinite(rows).all() for rows in signature.values()):
        return None
    trial = _fit_factors(regressed, signature)
    sizes = scaled(effects()[effect], columns, trial.factors)
    for parameter in effects()[effect].parameters:
        if not parameter.minimum <= sizes[parameter.name] <= parameter.maximum:
            return None
    gain = trial.gain if trial.deviations > GAIN_DEVIATIONS else 0.0
    return RankedEffect(effect, effect_values(effect, sizes), gain, trial.deviations)


def _fit_factors(regressed: _Regressed, signature: Mapping[str, FloatArray]) -> _Trial:
    """Estimates the factors that all equations share, and the gain.

    Each equation is weighted by the residual that it is left with in the end. With d the further
    moves of its own values, min |r + C d + S f|^2 + d' W d over d leaves a quadratic in f; the
    adjustments, shape (n, factors), are d per unit of each factor.
    """
    equations, before, start = regressed.equations, regressed.rows, regressed.start
    after = dict(before)
    penalty_before = regressed.penalties
    adjustments = {
        e.name: _solve(regressed.grams[e.name], -(e.columns.T @ signature[e.name]))
        for e in equations
    }
    factors = np.zeros(next(iter(signature.values())).shape[1])
    penalty_after: Mapping[str, float] = penalty_before
    for _ in range(WEIGHT_ITERATIONS):
        hessian = np.zeros((factors.size, factors.size))
        gradient = np.zeros(factors.size)
        for equation in equations:
            s = signature[equation.name]
            moves = s + equation.columns @ adjustments[equation.name]
            share = equation.independent / _cost(after, penalty_after, equation.name)
            hessian += share * (s.T @ moves)
            gradient += share * (s.T @ before[equation.name])
        factors = -_solve(hessian, gradient)
        moved = {e.name: adjustments[e.name] @ factors for e in equations}
        after = {
            e.name: before[e.name] + signature[e.name] @ factors + e.columns @ moved[e.name]
            for e in equations
        }
        penalty_after = {
            e.name: _prior_penalty(e, start[e.name] + moved[e.name]) for e in equations
        }
    return _Trial(factors, *_gain(equations, (before, penalty_before), (after, penalty_after)))


def _prior_penalty(equation: Equation, moves: FloatArray) -> float:
    """Penalty of the prior for the moves of the equation's own values, in squares of rows."""
    return float(np.sum(equation.weight * (moves - equation.centre) ** 2))


def _cost(rows: Mapping[str, FloatArray], penalties: Mapping[str, float], name: str) -> float:
    # The tolerance of each row adds its square, 1: below the tolerance there is little to gain.
    return float(rows[name] @ rows[name]) + penalties[name] + rows[name].size


def _solve(matrix: FloatArray, right_side: FloatArray) -> FloatArray:
    """Solves a symmetric system in any units; directions without information do not move."""
    scale = np.sqrt(np.diag(matrix))
    scale = np.where(scale > 0.0, scale, 1.0)
    divided = right_side / (scale if right_side.ndim == 1 else scale[:, np.newaxis])
    solved = np.linalg.lstsq(matrix / np.outer(scale, scale), divided, rcond=1e-10)[0]
    return np.asarray(solved / (scale if right_side.ndim == 1 else scale[:, np.newaxis]))


_State = tuple[Mapping[str, FloatArray], Mapping[str, float]]


def _gain(equations: Sequence[Equation], first: _State, last: _State) -> tuple[float, float]:
    """Gain, nats per independent statistic, and the gain over its standard deviation.

    A row gains ln(s_0 / s_1) + (r_0 / s_0)^2 / 2 - (r_1 / s_1)^2 / 2, with 0 before and 1 after.
    The sums over windows are taken for independent draws. s^2 includes the penalty of the prior.
    """
    total, by_block = 0.0, np.zeros(int(equations[0].block.max()) + 1)
    for equation in equations:
        r0, r1 = first[0][equation.name], last[0][equation.name]
        v0, v1 = (_cost(*state, equation.name) / r0.size for state in (first, last))
        gain = 0.5 * math.log(v0 / v1)
        total += gain
        # The penalty of the prior is spread over all rows, so that these add up to the gain.
        by_row = r0**2 / v0 - r1**2 / v1
        by_block += np.bincount(equation.block, gain + 0.5 * (by_row - by_row.mean()))
    scatter = float(np.std(by_block)) * math.sqrt(by_block.size)
    return total, float(by_block.sum()) / scatter if scatter > 0.0 else 0.0
