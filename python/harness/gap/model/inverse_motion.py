# SPDX-License-Identifier: MIT
"""Terms of the force balance, from the measured position and the driving force."""

from __future__ import annotations

import math

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.inverse_signals import (
    ATMOSPHERE_PA,
    Measured,
    Terms,
    Values,
    areas,
    filtered,
    last_direction,
    speed_of,
    terms_of,
    true_position,
)
from ehsid.harness.gap.model.inverse_valve import spool_of
from ehsid.harness.gap.model.weak_form import WeakForm
from ehsid.harness.gap.thresholds import STROKE_END

# A motor has no spool, whose bandwidth the plant has as a nuisance.
_NO_SPOOL = {"nuisance.spool_bandwidth_hz": 0.0}


def _motion(signals: Measured, values: Values, prefix: str, weak: WeakForm) -> Terms:
    """Inertia, friction and load in weak form, N, signed to add up with the driving force."""
    position = true_position(signals, values)
    middle = 0.5 * values["cylinder.stroke_m"] if prefix == "load" else 0.0
    from_middle = position - middle
    load = terms_of(values).load(from_middle)
    return {
        "inertia": -values[f"{prefix}.mass_kg"]
        * weak.curvature(_centre_of_mass(position, values, signals.dt_s)),
        "viscous": -values[f"{prefix}.viscous_friction_n_s_m"] * weak.slope(position),
        "load": -weak.mean(load),
        "friction": -weak.mean(_friction(signals, values, from_middle)),
    }


def _centre_of_mass(position: FloatArray, values: Values, dt_s: float) -> FloatArray:
    """Position of the whole moved mass, m: a part may hang on the rod by spring and damper.

    That part is at x'' + 2 zeta w (x' - y') + w^2 (x - y) = 0; y runs straight between samples.
    """
    share, frequency_hz, damping = terms_of(values).hanging_load
    if not share * frequency_hz > 0.0:
        return position
    w = 2.0 * math.pi * frequency_hz
    loss = 2.0 * damping * w
    hanging = filtered(position, np.array([loss, w * w]), np.array([1.0, loss, w * w]), dt_s)
    return np.asarray((1.0 - share) * position + share * hanging)


def _friction(signals: Measured, values: Values, from_middle: FloatArray) -> FloatArray:
    terms, velocity = terms_of(values), speed_of(signals)
    if not np.any(terms.friction(velocity, from_middle)):
        return np.zeros_like(velocity)
    # Where the rod rests, noise changes the sign of its speed; the bristles remember the motion.
    direction = last_direction(signals, values["nuisance.presliding_m"])
    velocity = np.copysign(velocity, direction)
    return np.asarray(terms.friction(velocity, from_middle) * direction)


def cylinder_force(
    signals: Measured, a: FloatArray, b: FloatArray, values: Values, weak: WeakForm
) -> Terms:
    """Terms of the force balance of a cylinder in weak form, N.

        0 = p_a A_a - p_b A_b - p_0 (A_a - A_b) - m y'' - b y' - load - friction

    All terms are zero where the test function includes an end of the stroke, because the end stops
    then push as well.
    """
    area_a, area_b = areas(values)
    ambient_pressure = values["nuisance.atmosphere"] * ATMOSPHERE_PA
    force = (a - ambient_pressure) * area_a - (b - ambient_pressure) * area_b
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
