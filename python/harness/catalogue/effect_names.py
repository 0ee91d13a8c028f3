# SPDX-License-Identifier: MIT
"""Names of effects for people, where their ids do not read as words."""

from __future__ import annotations

from types import MappingProxyType

_NAMES = MappingProxyType(
    {
        "coulomb_friction_sides": "Coulomb friction by direction",
        "makeup_check": "make-up valve",
        "valve_dead_band_sides": "unequal valve dead band",
    }
)


def effect_name(identifier: str) -> str:
    """Returns an id in words; names of people begin with a capital letter."""
    words = _NAMES.get(identifier, identifier.replace("_", " "))
    return words.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")
