# SPDX-License-Identifier: MIT
"""Equations and variables of tables in words, and in units for people."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

# Units for people: name, and how many there are in the SI unit.
OF_TERM: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "force": ("N", 1.0),
        "flow_a": ("l/min", 6e4),
        "flow_b": ("l/min", 6e4),
        "spool": ("%", 100.0),
        "sensor": ("mm", 1e3),
        "delay": ("ms", 1e3),
    }
)
OF_VARIABLE: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "velocity_m_s": ("mm/s", 1e3),
        "position_m": ("mm", 1e3),
        "spool": ("%", 100.0),
        "pressure_a_pa": ("bar", 1e-5),
        "pressure_b_pa": ("bar", 1e-5),
        "supply_pressure_pa": ("bar", 1e-5),
        "time_s": ("s", 1.0),
    }
)
TERM_WORDS: Mapping[str, str] = MappingProxyType(
    {
        "force": "force against extension",
        "flow_a": "flow into the cap side",
        "flow_b": "flow into the rod side",
        "spool": "opening of the valve",
        "sensor": "error of the position sensor",
        "delay": "delay of the command",
    }
)
VARIABLE_WORDS: Mapping[str, str] = MappingProxyType(
    {
        "velocity_m_s": "velocity",
        "position_m": "position",
        "spool": "spool position",
        "pressure_a_pa": "cap-side pressure",
        "pressure_b_pa": "rod-side pressure",
        "supply_pressure_pa": "supply pressure",
        "time_s": "time",
    }
)


def table_words(adds_to: str, of: str) -> str:
    """Returns what a table gives, such as "force against extension over the velocity"."""
    return f"{TERM_WORDS[adds_to]} over the {VARIABLE_WORDS[of]}"


def table_subsystem(adds_to: str, of: str) -> str:
    """Returns the subsystem to which a table belongs; flow over the spool is that of its edges."""
    if adds_to in ("flow_a", "flow_b"):
        return "valve" if of == "spool" else "hydraulics"
    return {"force": "mechanics", "spool": "valve", "sensor": "sensor", "delay": "timing"}[adds_to]
