# SPDX-License-Identifier: MIT
"""Which effect would remove what equations leave over: for the order of a search, no verdict.

Every effect is put into the equations at several sizes. What that changes in their residuals is a
column; all equations share its factor, and move their own values along with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.inference.trials import SIZES, candidates, full_names, scaled
from ehsid.harness.gap.model.equations import Equation
from ehsid.harness.gap.model.weak_form import regress
from ehsid.harness.gap.thresholds import SUSPECT_DEVIATIONS, SUSPECT_TURNS
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.parameters import acts_on, effects


@dataclass(frozen=True)
class Suspect:
    """An effect that would take something off the residuals.

    Attributes
    ----------
    effect
        id.
    values
        of its parameters, by full name, roughly.
    gain
        nats per independent statistic: sum over the equations of ln(rms before / rms after); zero
        where it is not beyond chance.
    deviations
        of the gain from zero, by its scatter over windows of half a second.
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


# Residual rows of the equations with the parameters of an effect, by full name, besides the rest.
Change = Callable[[Mapping[str, float]], Mapping[str, FloatArray]]


def suspects(
    found: Sequence[Equation], change: Change, rig: Rig, exclude: Sequence[str] = ()
) -> tuple[Suspect, ...]:
    """Effects that the rig does not tell, strongest first.

    Parameters
    ----------
    found
        equations.
    change
        their rows with an effect; where these are not finite, it is not tried.
    rig
        as told.
    exclude
        ids that are not asked for.
    """
    if not found:
        return ()
    base = {equation.name: equation.rows * equation.sigma for equation in found}
    skipped = {*rig.effects(), *exclude}
    suspected = []
    for effect, info in effects().items():
        if effect in skipped or not acts_on(info, rig.plant):
            continue
        trials = [
            _trial(effect, columns, found, base, change) for columns in candidates(effect, rig)
        ]
        best = max(filter(None, trials), key=lambda one: one.gain, default=None)
        if best is None:
            continue
        if effect in SIZES and best.gain > 0.0:
            # Once more at the size that the factor tells, which need not be in proportion.
            sizes = {name.rpartition(".")[2]: value for name, value in best.values.items()}
            again = _trial(effect, [sizes], found, base, change)
            best = again if again is not None and again.gain > best.gain else best
        suspected.append(best)
    return tuple(sorted(suspected, key=lambda one: -one.gain))


def _trial(
    effect: str,
    columns: Sequence[Mapping[str, float]],
    found: Sequence[Equation],
    base: Mapping[str, FloatArray],
    change: Change,
) -> Suspect | None:
    """None where it cannot be simulated, or would have to be of the other sign."""
    changed = [change(full_names(effect, column)) for column in columns]
    signature = {
        one.name: np.column_stack(
            [(rows[one.name] - base[one.name]) / one.sigma for rows in changed]
        )
        for one in found
    }
    if not all(np.isfinite(rows).all() for rows in signature.values()):
        return None
    trial = _try(found, signature)
    sizes = scaled(columns, trial.factors)
    for parameter in effects()[effect].parameters:
        if not parameter.minimum <= sizes[parameter.name] <= parameter.maximum:
            return None
    gain = trial.gain if trial.deviations > SUSPECT_DEVIATIONS else 0.0
    return Suspect(effect, full_names(effect, sizes), gain, trial.deviations)


def _try(found: Sequence[Equation], signature: Mapping[str, FloatArray]) -> _Trial:
    """Factors shared by all equations, each weighted by what it is left with in the end.

    With d the further moves of the equation's own values, min |r + C d + S f|^2 + d' W d over d
    leaves a quadratic in f.
    """
    # Without the bounds of the prior, which would hold values at what they took for the effect.
    start = {e.name: regress(e.rows, e.columns, e.centre, e.weight) for e in found}
    before = {e.name: e.rows + e.columns @ start[e.name] for e in found}
    after, spent = dict(before), {e.name: _spent(e, start[e.name]) for e in found}
    ways = {e.name: _follow(e, signature[e.name]) for e in found}
    factors = np.zeros(next(iter(signature.values())).shape[1])
    left = spent
    for _ in range(SUSPECT_TURNS):
        hessian = np.zeros((factors.size, factors.size))
        gradient = np.zeros(factors.size)
        for equation in found:
            s = signature[equation.name]
            moves = s + equation.columns @ ways[equation.name]
            share = equation.independent / _cost(after, left, equation.name)
            hessian += share * (s.T @ moves)
            gradient += share * (s.T @ before[equation.name])
        factors = -_solve(hessian, gradient)
        moved = {e.name: ways[e.name] @ factors for e in found}
        after = {
            e.name: before[e.name] + signature[e.name] @ factors + e.columns @ moved[e.name]
            for e in found
        }
        left = {e.name: _spent(e, start[e.name] + moved[e.name]) for e in found}
    return _Trial(factors, *_gain(found, (before, spent), (after, left)))


def _follow(equation: Equation, signature: FloatArray) -> FloatArray:
    """Moves of the equation's own values per factor."""
    c = equation.columns
    return _solve(c.T @ c + np.diag(equation.weight), -(c.T @ signature))


def _spent(equation: Equation, moved: FloatArray) -> float:
    """On the prior, in squares of rows."""
    return float(np.sum(equation.weight * (moved - equation.centre) ** 2))


def _cost(rows: Mapping[str, FloatArray], spent: Mapping[str, float], name: str) -> float:
    # Rows that are as quiet as they may be count as one: nothing is gained below.
    return float(rows[name] @ rows[name]) + spent[name] + rows[name].size


def _solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Of a symmetric matrix in any units; directions without information stay where they are."""
    scale = np.sqrt(np.diag(matrix))
    scale = np.where(scale > 0.0, scale, 1.0)
    divided = right / (scale if right.ndim == 1 else scale[:, np.newaxis])
    solved = np.linalg.lstsq(matrix / np.outer(scale, scale), divided, rcond=1e-10)[0]
    return np.asarray(solved / (scale if right.ndim == 1 else scale[:, np.newaxis]))


_State = tuple[Mapping[str, FloatArray], Mapping[str, float]]


def _gain(found: Sequence[Equation], first: _State, last: _State) -> tuple[float, float]:
    """Nats per independent statistic, and its deviations from zero.

    A row's gain: ln(s_0 / s_1) + (r_0 / s_0)^2 / 2 - (r_1 / s_1)^2 / 2; its sums over windows are
    taken for independent draws. s^2 counts what is spent on the prior, too.
    """
    total, by_block = 0.0, np.zeros(int(found[0].block.max()) + 1)
    for equation in found:
        r0, r1 = first[0][equation.name], last[0][equation.name]
        v0, v1 = (_cost(*state, equation.name) / r0.size for state in (first, last))
        gain = 0.5 * math.log(v0 / v1)
        total += gain
        # What was spent is spread over all rows, so that these add up to the gain.
        by_row = r0**2 / v0 - r1**2 / v1
        by_block += np.bincount(equation.block, gain + 0.5 * (by_row - by_row.mean()))
    scatter = float(np.std(by_block)) * math.sqrt(by_block.size)
    return total, float(by_block.sum()) / scatter if scatter > 0.0 else 0.0
