# SPDX-License-Identifier: MIT
"""Effects that have one name where only the cause matters."""

from __future__ import annotations

from collections.abc import Sequence

FRICTION = frozenset(("coulomb_friction", "stribeck_friction"))


def effect_families(effects: Sequence[str]) -> frozenset[str]:
    """Returns the set of effects with both laws of friction counted as one."""
    return frozenset("friction" if effect in FRICTION else effect for effect in effects)
