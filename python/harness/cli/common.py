# SPDX-License-Identifier: MIT
"""Functions that several commands share: errors, names of files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

import typer

from ..base.error_words import error_words
from ..base.text import printable


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
    from ..records.writing import FORMATS, format_of

    try:
        format_of(out)
    except ValueError:
        raise ValueError(
            f"--out {out}: the ending of the name says no format: expected one of "
            f"{', '.join('.' + ending for ending in sorted(FORMATS))}; name the file with one of "
            "them"
        ) from None
