# SPDX-License-Identifier: MIT
"""The only exception of this package: it names the file, the problem, its place and a remedy."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any, Self

MAX_NAMES_LISTED = 12


class RecordError(ValueError):
    """A record cannot be read or written as it is.

    Attributes
    ----------
    file
        path of the record, or the name of a record made in memory.
    problem
        description of the problem, without its place.
    row
        row of the first error, or None. In CSV it is the line number of an editor (the header is
        row 1); in Parquet, MAT and NPZ the first sample is row 1.
    column
        name of the faulty column, or None.
    expected
        what the file should contain instead, or None.
    mend
        remedy: what the reader of the message can do, or None.
    """

    def __init__(
        self,
        file: Path | str,
        problem: str,
        *,
        row: int | None = None,
        column: str | None = None,
        expected: str | None = None,
        mend: str | None = None,
    ) -> None:
        self.file = str(file)
        self.problem = problem
        self.row = row
        self.column = column
        self.expected = expected
        self.mend = mend
        super().__init__(self._message())

    def __reduce__(self) -> tuple[Callable[..., RecordError], tuple[str, str]]:
        """Keeps all arguments in pickling; by default an exception is rebuilt from `args` only."""
        return partial(type(self), **self._parts()), (self.file, self.problem)

    def changed(self, **parts: str | int | None) -> Self:
        """Returns the error with other parts, as its arguments are called."""
        return type(self)(self.file, self.problem, **{**self._parts(), **parts})

    def _parts(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("row", "column", "expected", "mend")}

    def _message(self) -> str:
        place = self.file
        if self.row is not None:
            place += f", row {self.row}"
        if self.column is not None:
            place += f", column '{self.column}'"
        message = f"{place}: {self.problem}."
        if self.expected:
            message += f" Expected: {_ended(self.expected)}"
        if self.mend:
            message += f" To fix it: {_ended(self.mend)}"
        return message


def _ended(text: str) -> str:
    return text if text.endswith("?") else f"{text}."


class MisnamedColumnError(RecordError):
    """No column has a name that the user gave; `nearest` may be meant, if it is not None."""

    nearest: str | None = None

    def with_remedy(self, how: str) -> Self:
        """Returns the error with the text to paste in its remedy."""
        asked = "name one of these columns, such as"
        if self.nearest is not None:
            asked = f"did you mean '{self.nearest}'?"
            how = how[0].upper() + how[1:]  # it begins a sentence
        error = self.changed(mend=f"{asked} {how}")
        error.nearest = self.nearest
        return error


def nearest_name(wanted: str, existing: Iterable[str]) -> str | None:
    """Returns the existing name closest to `wanted`, ignoring case; None if none is close."""
    by_folded = {name.casefold(): name for name in existing}
    # The cutoff is 0.5 instead of the 0.6 of difflib. A wrong suggestion costs little, because
    # `missing_column` also lists the names.
    matches = get_close_matches(wanted.casefold(), by_folded, n=1, cutoff=0.5)
    return by_folded[matches[0]] if matches else None


def missing_column(file: Path | str, wanted: str, existing: Iterable[str], why: str) -> RecordError:
    """Returns the error for a missing column, with the nearest name and a list of the columns."""
    names = list(existing)
    listed = ", ".join(names[:MAX_NAMES_LISTED])
    if len(names) > MAX_NAMES_LISTED:
        listed += f", and {len(names) - MAX_NAMES_LISTED} more"
    nearest = nearest_name(wanted, names)
    hint = f"rename '{nearest}' to '{wanted}' if that is it" if nearest else "add the column"
    return RecordError(
        file,
        f"there is no column '{wanted}'; the columns are: {listed or 'none'}",
        column=wanted,
        expected=why,
        mend=f"{hint}, or name the columns to use",
    )


def misnamed_column(
    file: Path | str, wanted: str, existing: Iterable[str], why: str, read_as: str = ""
) -> MisnamedColumnError:
    """Returns the error for a name that the user gave to a column, and that no column has.

    The nearest name is found without the units in brackets behind the names.
    """
    labels = {_label(name): name for name in existing}
    near = nearest_name(_label(wanted), labels)
    problem = missing_column(file, wanted, labels.values(), why).problem
    error = MisnamedColumnError(
        file,
        f"{problem} (read as {read_as})" if read_as else problem,
        column=wanted,
        expected=why,
        mend="name one of these columns" if near is None else f"did you mean '{labels[near]}'?",
    )
    error.nearest = None if near is None else labels[near]
    return error


def _label(name: str) -> str:
    return re.sub(r"(?<=\S)\s*\[[^\[\]]*\]\s*$", "", name)


def first_line(error: BaseException) -> str:
    """Returns the first line of an error's message without the full stop, or else its type."""
    return (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".")


@contextmanager
def damage_named(path: Path, kind: str) -> Iterator[None]:
    """Puts the error for a damaged file in place of those of the library that reads its kind."""
    try:
        yield
    except (RecordError, ModuleNotFoundError, KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # no common exception, and panics of Rust are no Exception
        raise RecordError(
            path,
            f"this is not a readable {kind} file ({first_line(error)})",
            expected=f"{'an' if kind == 'NPZ' else 'a'} {kind} file, as its name says",
            mend="export it again, or give it the extension of its real format",
        ) from None
