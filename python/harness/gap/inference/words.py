# SPDX-License-Identifier: MIT
"""Sets of effects and gaps as words of a sentence."""

from __future__ import annotations

from collections.abc import Sequence


def in_words(effects: Sequence[str]) -> str:
    """Returns the ids of effects as a list in words."""
    words = [effect.replace("_", " ") for effect in effects]
    words = [word.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck") for word in words]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def percent(gap: float) -> str:
    """Returns a gap in per cent, with two digits."""
    return f"{100.0 * gap:.2g} %"
