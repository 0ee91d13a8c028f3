# SPDX-License-Identifier: MIT
"""The command `ehsid`: one verb a file, parse and call."""

from __future__ import annotations

from typing import Annotated

import typer

import ehsid
from ehsid.harness.cli.effects import effects_command
from ehsid.harness.cli.estimate import estimate_command
from ehsid.harness.cli.experiment import experiment_command
from ehsid.harness.cli.export import export_command
from ehsid.harness.cli.gap import ManyValues, gap_command
from ehsid.harness.cli.gap_check import gap_check_command
from ehsid.harness.cli.gap_fleet import gap_fleet_command
from ehsid.harness.cli.hil import hil_command
from ehsid.harness.cli.identify import identify_command
from ehsid.harness.cli.inject import inject_command
from ehsid.harness.cli.simulate import simulate_command

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ehsid {ehsid.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="print the version and exit"
        ),
    ] = False,
) -> None:
    """Identify electro-hydraulic servos from their records."""


app.command("estimate")(estimate_command)
app.command("identify")(identify_command)
app.command("gap", cls=ManyValues)(gap_command)
app.command("inject")(inject_command)
app.command("gap-check")(gap_check_command)
app.command("gap-fleet", cls=ManyValues)(gap_fleet_command)
app.command("experiment")(experiment_command)
app.command("export")(export_command)
app.command("hil")(hil_command)
app.command("simulate")(simulate_command)
app.command("effects")(effects_command)


def main() -> None:
    """Entry point of the command `ehsid`."""
    app()
