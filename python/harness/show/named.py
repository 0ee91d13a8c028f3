# SPDX-License-Identifier: MIT
"""Effects and values by their names for people; the id, as files have it, appears on hovering."""

from __future__ import annotations

from collections.abc import Sequence

from .gap_words import effect_set, plain_name
from .page import Tagged


def named_effect(effect: str) -> Tagged:
    """Returns the cell with the name of an effect."""
    return Tagged(plain_name(effect), hint=effect)


def named_effects(effects: Sequence[str], before: str = "", tag: str = "") -> Tagged:
    """Returns the cell with the name of a set of effects; `before` and `tag` stand around it."""
    return Tagged(before + effect_set(tuple(effects)), tag, " + ".join(effects))
