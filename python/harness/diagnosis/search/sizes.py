# SPDX-License-Identifier: MIT
"""Least sizes of effects: what is smaller is part of every servo and is not reported."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...catalogue.keys import sizes_of
from ...catalogue.parameters import effects
from ...rigs import Rig
from ..model.machine import machine_scale

# Accuracy of a margin: it weighs a few nats, of which a hundredth is nothing.
MARGIN_STEP = 0.01
# Parts of what an effect has beyond a simpler one, of which one is of a usual size if the whole is
# too large. They are only looked at for the words of a reason.
PARTS = tuple(0.01 * k for k in range(1, 100))


def matters(effect: str, values: Mapping[str, float], rig: Rig) -> bool:
    """Whether an effect is larger than what every servo has without it.

    `EffectInfo.least_size` gives the reason for the least size.

    Parameters
    ----------
    effect
        id of the effect.
    values
        fitted values, by full name.
    rig
        the rig whose pressures, areas and flows set the scale.
    """
    return effects()[effect].matters(sizes_of(effect, values), machine_scale(rig))


def simpler_part(effect: str, values: Mapping[str, float], rig: Rig) -> str | None:
    """Returns the simpler effect that an effect contains, if this part alone matters; else None."""
    info = effects()[effect]
    if info.contains is None:
        return None
    simple = info.simplified(sizes_of(effect, values))
    return info.contains if effects()[info.contains].matters(simple, machine_scale(rig)) else None


def too_large(effect: str, values: Mapping[str, float], rig: Rig) -> bool:
    """Whether an effect that does not matter has more of its own than any servo has.

    Then a part of what it has beyond the simpler effect that it contains would matter.

    Parameters
    ----------
    effect, values, rig
        as in `matters`; the effect contains a simpler one, and does not matter.
    """
    info, scale = effects()[effect], machine_scale(rig)
    sizes = sizes_of(effect, values)
    same = info.same(info.simplified(sizes))
    return any(
        info.matters(
            {name: same[name] + part * (size - same[name]) for name, size in sizes.items()}, scale
        )
        for part in PARTS
    )


def margin(effect: str, values: Mapping[str, float], rig: Rig) -> float:
    """Returns ln of the factor by which an effect exceeds its least size, 0 to 1.

    The effect is made smaller, each parameter with the power by which the outputs depend on it,
    until it no longer matters. From a factor of e on, the margin is 1.

    Parameters
    ----------
    effect, values, rig
        as in `matters`; the effect matters.
    """
    info, scale = effects()[effect], machine_scale(rig)
    power = {parameter.name: parameter.power for parameter in info.parameters}
    sizes = sizes_of(effect, values)

    def still_matters(smaller: float) -> bool:
        return info.matters(
            {name: size * math.exp(-smaller * power[name]) for name, size in sizes.items()}, scale
        )

    if still_matters(1.0):
        return 1.0
    low, high = 0.0, 1.0
    while high - low > MARGIN_STEP:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if still_matters(middle) else (low, middle)
    return low
