# SPDX-License-Identifier: MIT
"""Reads effect values from a command line, written as effect.parameter=number."""

from __future__ import annotations

from collections.abc import Iterable

from ...catalogue.keys import ParameterKey
from ...rigs import RigError
from ...rigs.checks import check_values


def parse_settings(texts: Iterable[str]) -> dict[str, float]:
    """Returns values by full name from texts such as "coulomb_friction.force_n=400".

    Raises
    ------
    RigError
        a text has another form, a name is unknown, or a value is outside its range.
    """
    values: dict[str, float] = {}
    problems: list[str] = []
    for text in texts:
        name, equals, number = text.partition("=")
        if not equals or "." not in name:
            problems.append(
                f"'{text}': expected EFFECT.PARAMETER=NUMBER, as coulomb_friction.force_n=400"
            )
            continue
        effect, _, parameter = name.strip().partition(".")
        full = ParameterKey.of_effect(effect, parameter)
        try:
            value = float(number)
        except ValueError:
            problems.append(
                f"'{text}': expected EFFECT.PARAMETER=NUMBER; '{number}' is not a number"
            )
            continue
        problems += check_values({full: value})
        values[full] = value
    if problems:
        raise RigError("--effect", problems)
    return values
