# SPDX-License-Identifier: MIT
"""SI units of the inputs and outputs of a user's simulator."""

from __future__ import annotations

from types import MappingProxyType

from .simulator_section import COMMAND

# Contract name -> SI unit.
UNITS = MappingProxyType(
    {
        COMMAND: "V",
        "force_n": "N",
        "position_m": "m",
        "velocity_m_s": "m/s",
        "pressure_a_pa": "Pa",
        "pressure_b_pa": "Pa",
        "supply_pressure_pa": "Pa",
        "supply_flow_m3_s": "m^3/s",
        "flow_a_m3_s": "m^3/s",
        "flow_b_m3_s": "m^3/s",
    }
)
