# SPDX-License-Identifier: MIT
"""The only exception of this package: it names the file, the problem, its place and a remedy.

Limits on the size of input, so that a damaged or malicious file cannot exhaust the memory.

Each limit is a generous default that an environment variable replaces.
"""

from __future__ import annotations

import gzip
import os
import re
import stat
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, Self

from ..base.error_words import install_line

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


def missing_package(file: Path | str, package: str, does: str) -> RecordError:
    """Returns the error for a file whose kind needs a package that is not installed."""
    return RecordError(
        file,
        f"the package '{package}', which {does} files of this kind, is not installed",
        expected="the packages for logs",
        mend=f"install them with: {install_line('logs')}",
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


@dataclass(frozen=True)
class Limit:
    """A limit."""

    variable: str
    """Environment variable that replaces the default; a whole number above 0."""
    default: int
    """The limit without that variable."""
    unit: str
    """What is counted, as the message names it."""

    @property
    def most(self) -> int:
        """The largest allowed number.

        Raises
        ------
        ValueError
            the environment variable is not a whole number above 0.
        """
        text = os.environ.get(self.variable, str(self.default))
        # No number of bytes that a machine can hold has more digits than this.
        if not (text.isascii() and text.isdigit() and len(text) < 19 and int(text) > 0):
            raise ValueError(
                f"{self.variable}={text[:40]}: expected a whole number above 0; correct the "
                f"environment variable, or unset it for the default of {self.default}"
            )
        return int(text)

    @property
    def remedy(self) -> str:
        """What the user can do, for a message."""
        return f"set the environment variable {self.variable} to a larger number"

    def check(
        self, count: int, file: Path | str, *, row: int | None = None, at_least: bool = False
    ) -> None:
        """Checks a number; with `at_least` it is only known that there are so many or more.

        Raises
        ------
        RecordError
            the number is above the limit.
        """
        if count > self.most:
            raise RecordError(
                file,
                f"{'more than ' if at_least else ''}{self.most if at_least else count} {self.unit}",
                row=row,
                expected=f"at most {self.most} {self.unit}",
                mend=f"divide the record, or, if it is meant to be so large, {self.remedy}",
            )


BYTES = Limit("EHSID_MAX_BYTES", 2**30, "bytes of content")
SAMPLES = Limit("EHSID_MAX_SAMPLES", 20_000_000, "samples")
COLUMNS = Limit("EHSID_MAX_COLUMNS", 2_000, "columns")
# Room for the libraries that a reader imports, and for what they hold while they work.
ROOM_BYTES = 2**30
LINE = Limit("EHSID_MAX_LINE", 2**20, "bytes in one line")
GZIP_MAGIC = b"\x1f\x8b"


@contextmanager
def bounded_memory(file: Path | str) -> Iterator[None]:
    """Bounds the memory that is taken inside of the block, on systems that can.

    It is for readers that decompress whatever a file holds, even more than it states.

    Raises
    ------
    RecordError
        the block needs more than `ROOM_BYTES` and four times the limit on the content.
    """
    if sys.platform == "win32":
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except OSError:  # another system than Linux
        yield
        return
    most = pages * resource.getpagesize() + ROOM_BYTES + 4 * BYTES.most
    for limit in (soft, hard):
        most = most if limit == resource.RLIM_INFINITY else min(most, limit)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    try:
        yield
    except MemoryError:
        raise RecordError(
            file,
            "its content takes more memory than its limit allows",
            expected=f"at most {BYTES.most} {BYTES.unit}",
            mend=f"divide the record, or, if it is meant to be so large, {BYTES.remedy}",
        ) from None
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def read_file(path: Path, limit: Limit = BYTES) -> bytes:
    """Returns the content of a regular file; devices and pipes may have no end.

    Raises
    ------
    RecordError
        the path is not a regular file, or the file is larger than the limit.
    OSError
        the file cannot be read.
    """
    if not stat.S_ISREG(path.stat().st_mode):
        raise RecordError(
            path,
            "this is a device or a pipe, not a regular file",
            expected="a file",
            mend="write the data to a file first",
        )
    with path.open("rb") as file:
        data = file.read(limit.most + 1)
    limit.check(len(data), path, at_least=True)
    return data


def decompress(data: bytes, path: Path) -> bytes:
    """Returns the decompressed content of a gzip file.

    Raises
    ------
    RecordError
        the data are empty, not gzip, cut short, or damaged, or their content is beyond the limit.
    """
    if not data:
        raise RecordError(path, "the file is empty", expected="a gzip file", mend="export it again")
    if not data.startswith(GZIP_MAGIC):
        raise RecordError(
            path,
            "the name ends in .gz but the content is not gzip",
            expected="a gzip file",
            mend="rename it to .csv if it is plain text, or compress it again",
        )
    try:
        # One byte more than allowed tells; what comes behind it is never decompressed.
        with gzip.GzipFile(fileobj=BytesIO(data)) as file:
            content = file.read(BYTES.most + 1)
        BYTES.check(len(content), path, at_least=True)
        return content
    except EOFError:
        problem = "the compressed file is cut short"
    except (gzip.BadGzipFile, zlib.error) as error:
        problem = f"the compressed file is damaged ({error})"
    raise RecordError(
        path, problem, expected="a whole gzip file", mend="copy or compress the file again"
    )
