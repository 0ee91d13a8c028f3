# SPDX-License-Identifier: MIT
"""Sets of effects and gaps as words of a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from ...catalogue.effect_names import effect_name


def in_words(effects: Sequence[str]) -> str:
    """Returns the ids of effects as a list in words."""
    words = [effect_name(effect) for effect in effects]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def percent(gap: float) -> str:
    """Returns a gap in per cent, with two digits; from 100 % on, with all before the point."""
    in_percent = 100.0 * gap
    # The flag "#" keeps zeros at the end: 1.0 beside 0.78.
    return f"{in_percent:#.2g} %" if 0.0 < in_percent < 9.95 else f"{in_percent:.0f} %"


def chance(probability: float) -> str:
    """Returns a probability in per cent; none is told that is below 0.1 % or above 99 %."""
    if probability < 0.001:
        return "less than 0.1 %"
    return percent(probability) if probability <= 0.99 else "more than 99 %"
