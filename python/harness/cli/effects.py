# SPDX-License-Identifier: MIT
"""`ehsid effects`: lists the catalogue of effects."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

import ehsid


def _plain(effect: ehsid.EffectInfo) -> dict[str, Any]:
    return {
        "id": effect.id,
        "subsystem": effect.subsystem,
        "equation": effect.equation,
        "source": effect.source,
        "excitation": effect.excitation,
        "sensors": effect.sensors,
        "least_size": effect.least_size,
        "needs": list(effect.needs),
        "contains": effect.contains,
        "log_place": effect.log_place,
        "parameters": [
            {
                "name": parameter.name,
                "unit": parameter.unit,
                "minimum": parameter.minimum,
                "maximum": parameter.maximum,
                "typical": parameter.typical,
                "meaning": parameter.meaning,
            }
            for parameter in effect.parameters
        ],
    }


def effects_command(
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of a table")] = False,
) -> None:
    """List the effects the simulator knows: where they act, their parameters, what shows them.

    Example: ehsid effects
    """
    if as_json:
        typer.echo(json.dumps([_plain(effect) for effect in ehsid.effects()]))
        return
    table = Table(show_lines=True)
    for heading in ("effect", "parameters: range, typical", "shown by"):
        table.add_column(heading)
    for effect in ehsid.effects():
        parameters = "\n".join(
            f"{p.name}: {p.minimum:g} .. {p.maximum:g} {'' if p.unit == '1' else p.unit}, "
            f"{p.typical:g}"
            for p in effect.parameters
        )
        table.add_row(
            f"{effect.id}\n({effect.subsystem})",
            parameters,
            f"{effect.excitation}\n({effect.sensors})",
        )
    Console().print(table)
