# SPDX-License-Identifier: MIT
"""The one exception of this package: what is wrong in which file, where, and how to mend it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from difflib import get_close_matches
from functools import partial
from pathlib import Path

MAX_NAMES_LISTED = 12


class RecordError(ValueError):
    """A record that cannot be read or written as it is.

    Attributes
    ----------
    file
        path of the record, or the name of a record made in memory.
    problem
        what is wrong, without the place.
    row
        row of the first offence, or None. In CSV as an editor counts (the header is row 1);
        in Parquet, MAT and NPZ the first sample is row 1.
    column
        name of the offending column, or None.
    expected
        what should have been there, or None.
    mend
        what the reader of the message can do, or None.
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
        """From another process it comes back whole: exceptions are made again from `args` else."""
        made = partial(
            RecordError,
            row=self.row,
            column=self.column,
            expected=self.expected,
            mend=self.mend,
        )
        return made, (self.file, self.problem)

    def _message(self) -> str:
        place = self.file
        if self.row is not None:
            place += f", row {self.row}"
        if self.column is not None:
            place += f", column '{self.column}'"
        message = f"{place}: {self.problem}."
        if self.expected:
            message += f" Expected: {self.expected}."
        if self.mend:
            message += f" To fix it: {self.mend}."
        return message


def nearest_name(wanted: str, existing: Iterable[str]) -> str | None:
    """The existing name closest to `wanted`, compared without case; None where none is close."""
    by_folded = {name.casefold(): name for name in existing}
    # 0.5 rather than difflib's 0.6: 'pos' still finds 'position_m' no better, but 'u' for 'U' and
    # 'time' for 'time_s' do; a wrong suggestion costs little because the names are listed too.
    matches = get_close_matches(wanted.casefold(), by_folded, n=1, cutoff=0.5)
    return by_folded[matches[0]] if matches else None


def missing_column(file: Path | str, wanted: str, existing: Iterable[str], why: str) -> RecordError:
    """The error for a column that is not there: suggests the nearest name, lists what there is."""
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
