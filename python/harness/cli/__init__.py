# SPDX-License-Identifier: MIT
"""The command `ehsid`: one verb a file, parse and call."""

from __future__ import annotations

import typer

from ehsid.harness.cli.estimate import estimate_command
from ehsid.harness.cli.identify import identify_command

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    help="Identify electro-hydraulic servos from their records.",
)
app.command("estimate")(estimate_command)
app.command("identify")(identify_command)


def main() -> None:
    """Entry point of the command `ehsid`."""
    app()
