# SPDX-License-Identifier: MIT
"""Sizes of effects that every servo has anyway, so that smaller ones are not reported."""

from __future__ import annotations

from collections.abc import Mapping

from ehsid.harness.catalogue.keys import sizes_of
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.model.machine import machine_scale
from ehsid.harness.rigs import Rig


def matters(effect: str, values: Mapping[str, float], rig: Rig) -> bool:
    """Tells whether an effect of this size is more than a servo without it has anyway.

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
