# SPDX-License-Identifier: MIT
"""Values that a shell completes, beside the commands, options and choices that typer knows."""

from __future__ import annotations


def effect_ids(incomplete: str) -> list[str]:
    """Returns the ids of the catalogue that begin so."""
    from ..catalogue.parameters import effects

    return [effect for effect in effects() if effect.startswith(incomplete)]


def injected_effects(incomplete: str) -> list[str]:
    """Returns the effects that can be injected into a log and begin so."""
    from ..signals.injection.effects import COMMAND, POSITION

    return [effect for effect in (*COMMAND, *POSITION) if effect.startswith(incomplete)]


def effect_sizes(incomplete: str) -> list[str]:
    """Returns EFFECT.PARAMETER= for all parameters of effects that begin so."""
    from ..catalogue.parameters import effects

    named = [f"{info.id}.{one.name}=" for info in effects().values() for one in info.parameters]
    return [name for name in named if name.startswith(incomplete)]


def verdicts(incomplete: str) -> list[str]:
    """Returns the verdicts, the last of several with commas between them."""
    import typing

    from ..diagnosis.schema import Verdict

    before, comma, last = incomplete.rpartition(",")
    words = [*typing.get_args(Verdict), "any"]
    return [f"{before}{comma}{word}" for word in words if word.startswith(last)]
