# SPDX-License-Identifier: MIT
"""The smallest rig file that is whole, as a rig: no sensors, no effects."""

from ehsid.harness.rigs import Rig

RIG = Rig(
    "bench",
    "ehs",
    {
        "cylinder.bore_m": 0.063,
        "cylinder.rod_m": 0.035,
        "cylinder.stroke_m": 0.3,
        "cylinder.dead_volume_a_m3": 2.5e-4,
        "cylinder.dead_volume_b_m3": 2.5e-4,
        "load.mass_kg": 120.0,
        "load.viscous_friction_n_s_m": 900.0,
        "valve.rated_flow_m3_s": 6.33e-4,
        "valve.rated_pressure_drop_pa": 3.5e6,
        "valve.rated_command_v": 10.0,
        "supply.pressure_pa": 12e6,
        "supply.tank_pressure_pa": 2e5,
        "fluid.bulk_modulus_pa": 1.1e9,
    },
)
