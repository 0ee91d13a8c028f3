# SPDX-License-Identifier: MIT
"""The console of all commands: what it prints is data, never markup or control sequences.

Names of rigs, records and boards, and paths, are text of others. The console of rich would take
`[/red]` in them for markup, and a terminal would carry out escape sequences.

How much a command says on stderr: -v adds what it does, -q leaves only errors.

Both are options of every command, and may also stand before its name.

Functions that several commands share: errors, names of files.

Options that take all values up to the next option, such as `--validate a.csv b.csv`.
"""

from __future__ import annotations

import functools
import inspect
import logging
import sys
import typing
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, NoReturn

import rich.console
import typer
from rich.progress import TextColumn
from rich.table import Table
from rich.text import Text
from typer.core import TyperCommand

from ..base.error_words import error_words, printable
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


Verbose = Annotated[
    bool,
    typer.Option("--verbose", "-v", help="say on stderr what is done, with times"),
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="nothing on stderr but errors: no progress and no notes"),
]
LOGGER = logging.getLogger("ehsid")


class _Lines(logging.Handler):
    """Writes each message as a line on stderr, with the seconds since the command began."""

    def emit(self, record: logging.LogRecord) -> None:
        text = printable(record.getMessage())
        with suppress(OSError):  # a full disk behind stderr does not end the work
            sys.stderr.write(f"ehsid {record.relativeCreated / 1e3:7.1f} s: {text}\n")
            sys.stderr.flush()


def set_verbosity(*, verbose: bool, quiet: bool) -> None:
    """Sets what is said on stderr from now on.

    Raises
    ------
    ValueError
        both are asked for.
    """
    if verbose and quiet:
        raise ValueError("--verbose and --quiet: expected one of them; leave one out")
    set_quiet(quiet=quiet)
    for handler in [one for one in LOGGER.handlers if isinstance(one, _Lines)]:
        LOGGER.removeHandler(handler)
    if verbose:
        LOGGER.addHandler(_Lines())
    LOGGER.setLevel(logging.INFO if verbose else logging.WARNING)


def with_verbosity(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns the function of a command with the options -v and -q, which it need not know."""

    @functools.wraps(function)
    def run(ctx: typer.Context, *args: Any, verbose: bool, quiet: bool, **named: Any) -> Any:
        before = ctx.obj or {}  # what stood before the name of the command
        set_verbosity(
            verbose=verbose or before.get("verbose", False),
            quiet=quiet or before.get("quiet", False),
        )
        return function(*args, **named)

    types = typing.get_type_hints(function, include_extras=True)
    own = inspect.signature(function).parameters.values()
    added = {"verbose": Verbose, "quiet": Quiet}
    parameters = [
        inspect.Parameter("ctx", inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=typer.Context),
        *(
            one.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=types[one.name])
            for one in own
        ),
        *(
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=annotation
            )
            for name, annotation in added.items()
        ),
    ]
    # Typer reads the options of a command off its signature.
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {**types, **added, "ctx": typer.Context}
    return run


def refuse(message: str) -> NoReturn:
    """Prints an error message on stderr and ends the program with exit code 2."""
    with suppress(OSError):  # a full disk behind stderr
        typer.echo(f"ehsid: {printable(message)}", err=True)
    raise typer.Exit(2)


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Puts the path of the record in front of the message of a ValueError of the block."""
    try:
        yield
    except ValueError as error:
        if error_words(error) is None:
            raise
        raise ValueError(f"{path}: {error}") from error


def check_ending(out: Path) -> None:
    """Checks that the file `out` has the ending of a format in which records are written.

    Raises
    ------
    ValueError
        it has another ending, or none.
    """
    from ..records.record import FORMATS, format_of

    try:
        format_of(out)
    except ValueError:
        raise ValueError(
            f"--out {out}: the ending of the name says no format: expected one of "
            f"{', '.join('.' + ending for ending in sorted(FORMATS))}; name the file with one of "
            "them"
        ) from None


MANY = ("--validate", "--exclude-effect", "--features", "--curves")


class ManyValues(TyperCommand):
    """A command whose options `MANY` take several values; options of typer itself take one."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses the arguments after the option is repeated before each of its values."""
        return super().parse_args(ctx, repeated(args))


def repeated(arguments: Sequence[str]) -> list[str]:
    """Repeats each option of `MANY` before each of its values.

    "--validate a b" becomes "--validate a --validate b".
    """
    made: list[str] = []
    option, has_value = "", False
    for position, argument in enumerate(arguments):
        if argument == "--":
            return [*made, *arguments[position:]]
        if argument.startswith("-"):
            name, equals, _ = argument.partition("=")
            option, has_value = (name if name in MANY else ""), bool(equals)
        elif option:
            made += [option] if has_value else []
            has_value = True
        made.append(argument)
    return made
