# SPDX-License-Identifier: MIT
"""The console of all commands: what it prints is data, never markup or control sequences.

Names of rigs, records and boards, and paths, are text of others. The console of rich would take
`[/red]` in them for markup, and a terminal would carry out escape sequences.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import rich.console
from rich.progress import TextColumn
from rich.table import Table
from rich.text import Text

from ..base.text import printable
from ..show import page

# Colours of the kinds of text of a table.
_COLOURS = {"": "", "good": "green", "bad": "bold red", "soft": "dim"}

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


def print_blocks(blocks: Sequence[page.Told], console: Console) -> None:
    """Prints sentences, lists, and tables; an empty line parts a table from what stands above."""
    for i, block in enumerate(blocks):
        if isinstance(block, page.Table):
            if i:
                console.print()
            console.print(_table(block))
        elif isinstance(block, page.Items):
            print_points(map(page.cell_text, block.items), console, indent=0)
        else:
            console.print(block if isinstance(block, str) else block.text)


def _table(table: page.Table) -> Table:
    several = any("\n" in page.cell_text(cell) for row in table.rows for cell in row)
    shown = Table(
        title=table.caption or None,
        caption=table.note or None,
        caption_justify="left",
        show_lines=several,
    )
    for i, heading in enumerate(table.columns):
        right = i > 0 and table.align(i) == "number"
        words = heading if isinstance(heading, str) else ""
        shown.add_column(words, justify="right" if right else "left")
    for i, row in enumerate(table.rows):
        cells = [_cell(cell) for cell in row]
        if i in table.marked:
            cells[0].append(" *")
        shown.add_row(*cells)
    return shown


def _cell(cell: page.Cell) -> Text:
    kind = cell.kind if isinstance(cell, page.Tagged) else ""
    return Text(printable(page.cell_text(cell)), style=_COLOURS[kind])


class PlainColumn(TextColumn):
    """A column of a progress bar that shows a text as it is."""

    def __init__(self, text_format: str) -> None:
        super().__init__(text_format, markup=False)

    def render(self, task: Any) -> Text:
        """Returns the text of the task."""
        text = super().render(task)
        return Text(printable(text.plain), style=text.style, justify="left")
