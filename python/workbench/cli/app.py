# SPDX-License-Identifier: MIT
"""`ehsid app`: opens the workbench in the browser."""

from __future__ import annotations

import errno
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from ehsid.harness.cli.console import Console, refuse


def app_command(
    folder: Annotated[
        Path, typer.Argument(help="folder with the sessions, one for each machine; made if missing")
    ] = Path("ehsid_app"),
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="port on this machine; 0: a free one")
    ] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="only print the address")
    ] = False,
) -> None:
    r"""Open the workbench in the browser: from a log to the diagnosis, on this machine only.

    Needs the packages of the extra "app": pip install 'ehsid\[app,logs]'. Ctrl-C ends it, and all
    work that it has started.

    Example: ehsid app machines
    """
    from ..server import serve

    console = Console()

    def ready(address: str) -> None:
        console.print(f"workbench: {address}", soft_wrap=True)
        console.print(f"sessions: {folder.resolve()}", soft_wrap=True)
        console.print("The address has a token: who knows it can use the page. Ctrl-C ends it.")
        if not no_browser:
            webbrowser.open(address)

    try:
        serve(folder, port, ready=ready)
    except OSError as error:
        if error.errno != errno.EADDRINUSE:
            raise
        refuse(
            f"--port {port}: this port is taken by another program: expected a free one; name "
            "another port, or leave the option out"
        )
