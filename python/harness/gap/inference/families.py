# SPDX-License-Identifier: MIT
"""Effects that have one name where only the cause matters, and laws that contain another."""

from __future__ import annotations

from collections.abc import Sequence

from ehsid.harness.catalogue.parameters import effects as catalogue

FRICTION = frozenset(("coulomb_friction", "stribeck_friction"))


def effect_families(effects: Sequence[str]) -> frozenset[str]:
    """Returns the set of effects with both laws of friction counted as one."""
    return frozenset("friction" if effect in FRICTION else effect for effect in effects)


def law_count(effects: Sequence[str]) -> int:
    """Returns the number of effects, with a law that contains another counted as two.

    Stribeck friction is Coulomb friction and its rise towards rest. Both have to earn their name.
    """
    return sum(1 if catalogue()[effect].contains is None else 2 for effect in effects)
