# SPDX-License-Identifier: MIT
"""Sizes of effects that every servo has anyway, so that smaller ones are not reported."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ehsid.harness.gap.thresholds import (
    LEAST_AIR,
    LEAST_DELAY_S,
    LEAST_FORCE,
    LEAST_FRICTION,
    LEAST_LAG_S,
    LEAST_LEAKAGE,
    LEAST_OPENING,
    LEAST_PLAY,
    LEAST_PLAY_M,
    LEAST_RISE,
    MOST_RISE,
    SLOWEST_HIDDEN_HZ,
)
from ehsid.harness.rigs import Rig

STROKE = "cylinder.stroke_m"


def matters(effect: str, values: Mapping[str, float], rig: Rig) -> bool:
    """Tells whether an effect of this size is more than a servo without it has anyway.

    Parameters
    ----------
    effect
        id of the effect.
    values
        fitted values, by full name.
    rig
        the rig whose pressures, areas and flows set the scale.
    """

    def size(name: str) -> float:
        return values[f"effects.{effect}.{name}"]

    force, flow, pressure = scales(rig)
    match effect:
        case "transport_delay":
            return size("delay_s") >= LEAST_DELAY_S
        case "valve_hysteresis":
            return size("half_width") >= LEAST_OPENING
        case "valve_null_bias":
            return abs(size("offset")) >= LEAST_OPENING
        case "valve_dead_band":
            return size("overlap") >= LEAST_OPENING
        case "valve_lag":
            return size("bandwidth_hz") <= SLOWEST_HIDDEN_HZ
        case "valve_flow_saturation":
            return size("limit") < 1.9
        case "internal_leakage":
            return size("coefficient_m3_s_pa") * pressure >= LEAST_LEAKAGE * flow
        case "external_leakage":
            both = size("coefficient_a_m3_s_pa") + size("coefficient_b_m3_s_pa")
            return both * pressure >= LEAST_LEAKAGE * flow
        case "entrained_air":
            return size("volume_fraction") >= LEAST_AIR
        case "supply_droop":
            return size("source_resistance_pa_s_m3") * flow >= LEAST_FORCE * pressure
        case "coulomb_friction":
            return size("force_n") >= LEAST_FRICTION * force
        case "stribeck_friction":
            # Without a rise of the force towards rest the effect is the same as Coulomb friction.
            least, most = (rise * size("coulomb_n") for rise in (LEAST_RISE, MOST_RISE))
            return least <= size("static_n") <= most and size("static_n") >= LEAST_FRICTION * force
        case "load_force":
            # An axis has neither zero errors of pressure sensors nor the atmosphere on a rod, so
            # that a smaller force counts.
            least = LEAST_FORCE if rig.plant == "ehs" else LEAST_FRICTION
            return abs(size("force_n")) >= least * force
        case "load_spring":
            reach = rig.values.get(STROKE, 1.0)
            return size("stiffness_n_m") * reach >= LEAST_FORCE * force
        case "sensor_lag":
            return size("time_constant_s") >= LEAST_LAG_S
        case "sensor_backlash":
            return size("half_width_m") >= max(
                LEAST_PLAY_M, LEAST_PLAY * rig.values.get(STROKE, 0.0)
            )
    return True


def scales(rig: Rig) -> tuple[float, float, float]:
    """Largest force, N, flow at rated command and full pressure drop, m^3/s, and pressure, Pa."""
    v = rig.values
    if rig.plant != "ehs":
        return 10.0 * v.get("axis.force_per_volt", 100.0), np.inf, 1.0
    pressure = v["supply.pressure_pa"]
    flow = v["valve.rated_flow_m3_s"] * np.sqrt(0.5 * pressure / v["valve.rated_pressure_drop_pa"])
    return 0.25 * np.pi * v["cylinder.bore_m"] ** 2 * pressure, float(flow), pressure
