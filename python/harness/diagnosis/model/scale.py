# SPDX-License-Identifier: MIT
"""Scales of a machine, to which the sizes of effects are in proportion."""

from __future__ import annotations

import math

import ehsid

from ...catalogue.parameters import effects
from ...rigs import Rig

STROKE = "cylinder.stroke_m"
# To three digits: the fits start from sizes in proportion to it, and a start that differs in the
# fourth digit ends a fit elsewhere within its tolerance. A scale needs no more digits.
QUARTER_PI = 0.785


def machine_scale(rig: Rig) -> ehsid.MachineScale:
    """Returns the largest force, flow and pressure of a rig, and its stroke.

    The force of an axis is its force at a command of 10 V. A linear servo has no data sheet: its
    force is that of an axis with 100 N/V, its pressure the pressure drop at full flow. Those of a
    user's simulator stand in its rig file, or are those of a common servo.
    """
    v = rig.values
    if rig.simulator is not None:
        scales = rig.simulator.scales
        flow = scales.get("flow_m3_s", 1e-3)
        return ehsid.MachineScale(
            force_n=scales.get("force_n", 1e4),
            rated_flow_m3_s=flow,
            full_flow_m3_s=flow,
            pressure_pa=v.get("supply.pressure_pa", 1e7),
            stroke_m=v.get(STROKE, math.nan),
            has_valve=True,
        )
    if rig.plant != "ehs":
        return ehsid.MachineScale(
            force_n=10.0 * v.get("axis.force_per_volt", 100.0),
            rated_flow_m3_s=1e-3,
            full_flow_m3_s=1e-3,
            pressure_pa=1e7,
            stroke_m=v.get(STROKE, math.nan),
            has_valve=False,
        )
    pressure, rated = v["supply.pressure_pa"], v["valve.rated_flow_m3_s"]
    return ehsid.MachineScale(
        force_n=QUARTER_PI * v["cylinder.bore_m"] ** 2 * pressure,
        rated_flow_m3_s=rated,
        full_flow_m3_s=rated * math.sqrt(0.5 * pressure / v["valve.rated_pressure_drop_pa"]),
        pressure_pa=pressure,
        stroke_m=v[STROKE],
        has_valve=True,
    )


def effect_starts(effect: str, rig: Rig) -> list[dict[str, float]]:
    """Returns the sizes of an effect at which its fits start, by the parameters' own names.

    The first size is never zero, see `scan_starts`. There are no starts for an effect that the
    record shows without a fit, such as quantisation. Around a user's simulator there is one of
    either sign: derivatives by differences do not lead a fit through the size zero, where the other
    sizes of the effect have no influence.
    """
    info = effects()[effect]
    first = info.parameters[0]
    starts = [start for start in info.starts(machine_scale(rig)) if start[first.name] != 0.0]
    if rig.simulator is None or first.minimum != -first.maximum:
        return starts
    signs = {math.copysign(1.0, start[first.name]) for start in starts}
    if len(signs) > 1:
        return starts
    return starts + [start | {first.name: -start[first.name]} for start in starts]


def scan_starts(effect: str, rig: Rig) -> list[dict[str, float]]:
    """Returns starts whose first size is zero; most effects have none.

    The first step of a fit finds the first size that is best beside the others. So many values of
    the others can be tried, one of which lies near the minimum. For our simulator alone, see
    `effect_starts`.
    """
    if rig.simulator is not None:
        return []
    info = effects()[effect]
    first = info.parameters[0].name
    return [start for start in info.starts(machine_scale(rig)) if start[first] == 0.0]
