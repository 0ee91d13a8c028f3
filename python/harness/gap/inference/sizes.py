# SPDX-License-Identifier: MIT
"""Least sizes of effects: what is smaller is part of every servo and is not reported."""

from __future__ import annotations

from collections.abc import Mapping

from ehsid.harness.catalogue.keys import sizes_of
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.model.machine import machine_scale
from ehsid.harness.rigs import Rig


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
