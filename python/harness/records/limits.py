# SPDX-License-Identifier: MIT
"""Limits on the size of input, so that a damaged or malicious file cannot exhaust the memory.

Each limit is a generous default that an environment variable replaces.
"""

from __future__ import annotations

import gzip
import os
import stat
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from .errors import RecordError


@dataclass(frozen=True)
class Limit:
    """A limit.

    Attributes
    ----------
    variable
        environment variable that replaces the default; a whole number above 0.
    default
        the limit without that variable.
    unit
        what is counted, as the message names it.
    """

    variable: str
    default: int
    unit: str

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
