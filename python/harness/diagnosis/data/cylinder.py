# SPDX-License-Identifier: MIT
"""What follows from the values of a cylinder and its valve: areas, full speed, oil spring."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...rigs import Rig


def areas(values: Mapping[str, float]) -> tuple[float, float]:
    """Areas of the piston on the cap side and on the rod side, m^2."""
    cap = 0.25 * math.pi * values["cylinder.bore_m"] ** 2
    return cap, cap - 0.25 * math.pi * values["cylinder.rod_m"] ** 2


def full_speed(values: Mapping[str, float]) -> float:
    """Speed of the rod with a fully open valve and without load, m/s."""
    # Without load about half of the pressure is lost at each metering edge.
    drop = 0.5 * (values["supply.pressure_pa"] - values["supply.tank_pressure_pa"])
    flow = values["valve.rated_flow_m3_s"] * math.sqrt(
        drop / values["valve.rated_pressure_drop_pa"]
    )
    return flow / (0.25 * math.pi * values["cylinder.bore_m"] ** 2)


def oil_spring_hz(rig: Rig) -> float | None:
    """Natural frequency of the load on the oil at mid-stroke, Hz; None for a plant without oil."""
    v = rig.values
    if rig.plant == "axis":
        return None
    if rig.plant == "linear":
        # omega^2 = 4 beta_e A_p^2 / (V_t M_t) (H. Merritt, Hydraulic Control Systems, 1967)
        square = 4.0 * v["linear.bulk_modulus_pa"] * v["linear.area_m2"] ** 2
        square /= v["linear.volume_m3"] * v["linear.mass_kg"]
        return math.sqrt(square) / (2.0 * math.pi)
    cap, annulus = areas(v)
    half = 0.5 * v["cylinder.stroke_m"]
    # omega^2 = beta (A_a^2 / V_a + A_b^2 / V_b) / m: the two chambers are springs side by side.
    stiffness = v["fluid.bulk_modulus_pa"] * (
        cap**2 / (v["cylinder.dead_volume_a_m3"] + cap * half)
        + annulus**2 / (v["cylinder.dead_volume_b_m3"] + annulus * half)
    )
    return math.sqrt(stiffness / v["load.mass_kg"]) / (2.0 * math.pi)
