# SPDX-License-Identifier: MIT
"""Reads the sizes of effects from the command line of `ehsid inject`."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..records.errors import nearest_name
from ..signals.injection import InjectError, injectable


def parse_sizes(
    effects: Sequence[str], texts: Sequence[str], plant: str
) -> dict[str, dict[str, float]]:
    """Returns sizes in SI by effect and parameter, from texts such as "overlap=0.04".

    Raises
    ------
    InjectError
        an effect is named twice, a text has another form, a parameter is set twice, or it belongs
        to none or to several of the effects.
    """
    sizes: dict[str, dict[str, float]] = {effect: {} for effect in effects}
    if len(sizes) < len(effects):
        twice = next(effect for effect in effects if effects.count(effect) > 1)
        raise InjectError(f"--effect {twice}: name each effect once")
    there = injectable(plant)
    owners: dict[str, list[str]] = {}
    for effect in effects:
        for name in there.get(effect, {}):
            owners.setdefault(name, []).append(effect)
            owners.setdefault(f"{effect}.{name}", []).append(effect)
    for text in texts:
        name, equals, number = (part.strip() for part in text.partition("="))
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not equals or not math.isfinite(value):
            raise InjectError(f"--set {text}: expected PARAMETER=NUMBER, as overlap=0.04")
        # If no effect can be put in, `inject` reports that, with a list of those that can.
        if not owners and effects:
            continue
        if name not in owners:
            nearest = nearest_name(name, owners)
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise InjectError(
                f"--set {text}: expected a parameter of an effect that is named with "
                f"--effect; none has '{name}'{hint}"
            )
        if len(owners[name]) > 1:
            both = " and ".join(owners[name])
            raise InjectError(f"--set {text}: {both} have it; write EFFECT.{name}=NUMBER")
        parameters = sizes[owners[name][0]]
        if name.rpartition(".")[2] in parameters:
            raise InjectError(f"--set {text}: '{name}' is set twice; expected each parameter once")
        parameters[name.rpartition(".")[2]] = value
    return sizes
