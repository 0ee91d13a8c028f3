# SPDX-License-Identifier: MIT
"""The console of all commands: what it prints is data, never markup or control sequences.

Names of rigs, records and boards, and paths, are text of others. The console of rich would take
`[/red]` in them for markup, and a terminal would carry out escape sequences.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import rich.console
from rich.progress import TextColumn
from rich.text import Text

from ..base.text import printable

_STATE = {"quiet": False}


def set_quiet(*, quiet: bool) -> None:
    """Sets whether consoles of stderr are silent from now on; errors do not go through them."""
    _STATE["quiet"] = quiet


def note(text: str) -> None:
    """Prints a line on stderr, unless the user wants none."""
    Console(stderr=True).print(text, soft_wrap=True)


class Console(rich.console.Console):
    """A console that prints every text as it is; use `style` for emphasis."""

    def __init__(self, *, stderr: bool = False, **settings: Any) -> None:
        settings.setdefault("quiet", stderr and _STATE["quiet"])
        super().__init__(stderr=stderr, markup=False, emoji=False, highlight=False, **settings)

    def render_str(self, text: str, **settings: Any) -> Text:
        """Returns the text as rich prints it; every str comes through here, cells too."""
        return super().render_str(printable(text), **settings)


def print_points(points: Iterable[str], console: Console, *, indent: int = 2) -> None:
    """Prints a list: each point begins with a dash, and its further lines stand below its text."""
    for point in points:
        lines = Text(printable(point)).wrap(console, console.width - indent - 2)
        for i, line in enumerate(lines):
            mark = "  " if i else "- "
            console.print(f"{' ' * indent}{mark}{line.plain.rstrip()}", soft_wrap=True)


class PlainColumn(TextColumn):
    """A column of a progress bar that shows a text as it is."""

    def __init__(self, text_format: str) -> None:
        super().__init__(text_format, markup=False)

    def render(self, task: Any) -> Text:
        """Returns the text of the task."""
        text = super().render(task)
        return Text(printable(text.plain), style=text.style, justify="left")
