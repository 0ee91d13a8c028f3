# SPDX-License-Identifier: MIT
"""Which effect would remove what the equations leave over: for the order of a search, no verdict.

Every effect is put into the inverse equations at several sizes. What that changes in their
residuals is a column; all equations share its factor, and move their own values along with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from ehsid.harness.gap.equations import Equation, residuals
from ehsid.harness.gap.inverse_signals import Measured
from ehsid.harness.gap.starts import effect_starts
from ehsid.harness.gap.thresholds import SUSPECT_DEVIATIONS, SUSPECT_TURNS
from ehsid.harness.gap.weak_form import regress
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.parameters import EFFECT_PREFIX, acts_on, effects

FloatArray = npt.NDArray[np.float64]

# Sizes of what is not in proportion to its parameter, a factor of two apart; in between the factor
# of the column does well enough to rank.
_SIZES: Mapping[str, tuple[str, tuple[float, ...]]] = MappingProxyType(
    {
        "valve_dead_band": ("overlap", (0.01, 0.02, 0.04, 0.08)),
        "valve_hysteresis": ("half_width", (0.01, 0.02, 0.04, 0.08)),
        "valve_flow_saturation": ("limit", (0.15, 0.3, 0.6, 1.2)),
        "transport_delay": ("delay_s", (0.001, 0.002, 0.004, 0.008)),
        "sensor_backlash": ("half_width_m", (5e-5, 1e-4, 2e-4, 4e-4)),
        "entrained_air": ("volume_fraction", (0.002, 0.01, 0.04)),
        "sensor_lag": ("time_constant_s", (0.002, 0.008)),
        "valve_null_bias": ("offset", (0.01,)),
    }
)
# Several columns, each with a factor of its own: the parameters that an effect is linear in.
_COLUMNS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "external_leakage": ("coefficient_a_m3_s_pa", "coefficient_b_m3_s_pa"),
        "load_spring": ("stiffness_n_m", "force_at_mid_stroke_n"),
    }
)
_STRIBECK_SPEEDS = (0.005, 0.02, 0.08)


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


def suspects(
    found: Sequence[Equation],
    signals: Sequence[Measured],
    rig: Rig,
    values: Mapping[str, float],
    exclude: Sequence[str] = (),
) -> tuple[Suspect, ...]:
    """Effects that the rig does not tell, strongest first.

    Parameters
    ----------
    found, signals
        equations at `values`, and the records' signals.
    rig
        as told.
    values
        all of the plant.
    exclude
        ids that are not asked for.
    """
    if not found:
        return ()
    base = {equation.name: equation.rows for equation in found}
    skipped = {*rig.effects(), *exclude}
    suspected = []
    for effect, info in effects().items():
        if effect in skipped or not acts_on(info, rig.plant):
            continue
        signs = {p.name: p.minimum < 0.0 for p in info.parameters}
        best: Suspect | None = None
        for columns in _candidates(effect, rig):
            changed = [
                residuals(signals, {**values, **_full(effect, column)}, rig.plant)
                for column in columns
            ]
            signature = {
                name: np.column_stack([one[name] - base[name] for one in changed]) for name in base
            }
            trial = _try(found, signature)
            sizes = _scaled(columns, trial.factors)
            if any(size < 0.0 and not signs[name] for name, size in sizes.items()):
                continue
            gain = trial.gain if trial.deviations > SUSPECT_DEVIATIONS else 0.0
            if best is None or gain > best.gain:
                best = Suspect(effect, _full(effect, sizes), gain, trial.deviations)
        if best is not None:
            suspected.append(best)
    return tuple(sorted(suspected, key=lambda one: -one.gain))


def _full(effect: str, parameters: Mapping[str, float]) -> dict[str, float]:
    return {f"{EFFECT_PREFIX}{effect}.{name}": value for name, value in parameters.items()}


def _candidates(effect: str, rig: Rig) -> list[list[dict[str, float]]]:
    """Trials of an effect: each a list of columns, a column a set of parameters."""
    if effect in _SIZES:
        name, sizes = _SIZES[effect]
        return [[{name: size}] for size in sizes]
    if effect == "stribeck_friction":
        size = effect_starts(effect, rig)[0]["coulomb_n"]
        return [
            [
                {"coulomb_n": size, "static_n": size, "stribeck_velocity_m_s": speed},
                {"coulomb_n": 0.0, "static_n": size, "stribeck_velocity_m_s": speed},
            ]
            for speed in _STRIBECK_SPEEDS
        ]
    try:
        starts = effect_starts(effect, rig)
    except KeyError:
        # A property of the sensor that is in the floor.
        return []
    if effect in _COLUMNS:
        sizes_of = dict(starts[0])
        # What starts from nothing, a force at mid-stroke, as large as the other over 0.1 m.
        other = 0.1 * max(sizes_of.values())
        return [
            [
                {**dict.fromkeys(sizes_of, 0.0), name: sizes_of[name] or other}
                for name in _COLUMNS[effect]
            ]
        ]
    if effect in ("supply_droop", "valve_lag"):
        return [[dict(start)] for start in starts]
    return [[dict(starts[0])]]


def _scaled(columns: Sequence[Mapping[str, float]], factors: FloatArray) -> dict[str, float]:
    """The parameters at the factors: sums of those that the effect is linear in."""
    if len(columns) == 1 and len(columns[0]) > 1:
        # A line or a lag: the factor says how much of it, not with which constants.
        return dict(columns[0])
    found: dict[str, float] = {}
    for column, factor in zip(columns, factors.tolist(), strict=True):
        for name, size in column.items():
            if name == "stribeck_velocity_m_s":
                found[name] = size
            else:
                found[name] = found.get(name, 0.0) + factor * size
    return found


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
    return float(rows[name] @ rows[name]) + spent[name]


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
