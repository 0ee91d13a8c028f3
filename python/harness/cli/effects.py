# SPDX-License-Identifier: MIT
"""`ehsid effects`: lists the catalogue of effects."""

from __future__ import annotations

import json
from typing import Any

import typer

import ehsid

from ..show.page import Table
from .console import Console, print_blocks
from .options import AsJson

# Attributes of an effect and of a parameter in the JSON output, in its order.
EFFECT_KEYS = (
    *("id", "subsystem", "equation", "source", "excitation", "sensors"),
    *("least_size", "needs", "contains", "log_place"),
)
PARAMETER_KEYS = ("name", "unit", "minimum", "maximum", "typical", "meaning")


def _plain(effect: ehsid.EffectInfo) -> dict[str, Any]:
    parameters = [{key: getattr(p, key) for key in PARAMETER_KEYS} for p in effect.parameters]
    return {key: getattr(effect, key) for key in EFFECT_KEYS} | {"parameters": parameters}


def effects_command(
    as_json: AsJson = False,
) -> None:
    """List the effects the simulator knows: where they act, their parameters, what shows them.

    Example: ehsid effects
    """
    if as_json:
        typer.echo(json.dumps([_plain(effect) for effect in ehsid.effects()]))
        return
    rows = [
        (
            f"{effect.id}\n({effect.subsystem})",
            _ranges(effect),
            f"{effect.excitation}\n({effect.sensors})",
        )
        for effect in ehsid.effects()
    ]
    headings = ("effect", "parameters: range, typical", "shown by")
    print_blocks([Table("", headings, rows)], Console())


def _ranges(effect: ehsid.EffectInfo) -> str:
    return "\n".join(
        f"{p.name}: {p.minimum:g} .. {p.maximum:g}{'' if p.unit == '1' else f' {p.unit}'}, "
        f"{p.typical:g}"
        for p in effect.parameters
    )
