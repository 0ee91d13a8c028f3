# SPDX-License-Identifier: MIT
"""Terms of the force balance, from the measured position and the driving force."""

from __future__ import annotations

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.inverse_signals import (
    ATMOSPHERE_PA,
    Measured,
    Terms,
    Values,
    areas,
    side,
    speed_of,
    true_position,
)
from ehsid.harness.gap.model.inverse_valve import spool_of
from ehsid.harness.gap.model.weak_form import WeakForm
from ehsid.harness.gap.thresholds import STROKE_END

_NO_SPOOL = {
    "effects.valve_hysteresis.half_width": 0.0,
    "effects.valve_lag.bandwidth_hz": 0.0,
    "nuisance.spool_bandwidth_hz": 0.0,
}


def _motion(signals: Measured, values: Values, prefix: str, weak: WeakForm) -> Terms:
    """Inertia, friction and load in weak form, N, signed to add up with the driving force."""
    position = true_position(signals, values)
    middle = 0.5 * values["cylinder.stroke_m"] if prefix == "load" else 0.0
    spring = "effects.load_spring."
    load = (
        values[f"{spring}stiffness_n_m"] * (position - middle)
        + values[f"{spring}force_at_mid_stroke_n"]
        + values["effects.load_force.force_n"]
    )
    return {
        "inertia": -values[f"{prefix}.mass_kg"] * weak.curvature(position),
        "viscous": -values[f"{prefix}.viscous_friction_n_s_m"] * weak.slope(position),
        "load": -weak.mean(load),
        "friction": -weak.mean(_friction(signals, values)),
    }


def _friction(signals: Measured, values: Values) -> FloatArray:
    coulomb = values["effects.coulomb_friction.force_n"]
    prefix = "effects.stribeck_friction."
    sliding, static = values[f"{prefix}coulomb_n"], values[f"{prefix}static_n"]
    if coulomb == sliding == static == 0.0:
        return np.zeros(signals.command.size)
    level = np.full(signals.command.size, coulomb + sliding)
    velocity = values[f"{prefix}stribeck_velocity_m_s"]
    if velocity > 0.0:
        level += (static - sliding) * np.exp(-((speed_of(signals) / velocity) ** 2))
    return level * side(signals, values["nuisance.presliding_m"])


def cylinder_force(
    signals: Measured, a: FloatArray, b: FloatArray, values: Values, weak: WeakForm
) -> Terms:
    """Terms of the force balance of a cylinder in weak form, N.

        0 = p_a A_a - p_b A_b - p_0 (A_a - A_b) - m y'' - b y' - load - friction

    All terms are zero where the test function includes an end of the stroke, because the end stops
    then push as well.
    """
    area_a, area_b = areas(values)
    outside = values["nuisance.atmosphere"] * ATMOSPHERE_PA
    force = (a - outside) * area_a - (b - outside) * area_b
    terms = {"drive": weak.mean(force), **_motion(signals, values, "load", weak)}
    position, end = signals.columns["position_m"], STROKE_END * values["cylinder.stroke_m"]
    at_end = (position < end) | (position > values["cylinder.stroke_m"] - end)
    free = weak.mean(at_end.astype(np.float64)) == 0.0
    return {name: term * free for name, term in terms.items()}


def axis_force(signals: Measured, values: Values, weak: WeakForm) -> Terms:
    """Terms of the force balance of an axis, N: 0 = gain u - m y'' - b y' - load - friction."""
    command = spool_of(signals, {**values, **_NO_SPOOL})
    force = values["axis.force_per_volt"] * command
    return {"drive": weak.mean(force), **_motion(signals, values, "axis", weak)}
