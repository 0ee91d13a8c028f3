# SPDX-License-Identifier: MIT
"""The only exception of this package: it reports all problems of a rig file together.

Reads the text of a TOML file and parses its tables; reports the errors in the file.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..records import RecordError
from ..records.errors import Limit, read_file

# More problems than this are counted in the message, not listed.
MOST_LISTED = 20


class RigError(ValueError):
    """A rig that cannot be read, written or simulated as it is.

    Attributes
    ----------
    source
        path of the rig file, or name of a rig made in memory.
    problems
        the problems, one line each: key, value, and what was expected.
    """

    def __init__(self, source: object, problems: Sequence[str]) -> None:
        self.source = str(source)
        # A quoted TOML key may contain any character, also line ends. Characters that cannot be
        # printed are escaped, so that each problem stays on one line.
        printable = ("".join(c if c.isprintable() else repr(c)[1:-1] for c in p) for p in problems)
        self.problems = tuple(dict.fromkeys(printable))
        lines = "".join(f"\n  {problem}" for problem in self.problems[:MOST_LISTED])
        if len(self.problems) > MOST_LISTED:
            lines += f"\n  and {len(self.problems) - MOST_LISTED} more"
        super().__init__(
            f"{self.source}: {lines.strip()}"
            if len(self.problems) == 1
            else f"{self.source}: {len(self.problems)} problems{lines}"
        )

    def __reduce__(self) -> tuple[type[RigError], tuple[str, tuple[str, ...]]]:
        """Keeps both arguments in pickling; by default an exception is rebuilt from `args` only."""
        return RigError, (self.source, self.problems)


RIG_BYTES = Limit("EHSID_MAX_RIG_BYTES", 2**20, "bytes")
# More dots than this are in no key of a rig. The parser takes time with the square of their number.
MOST_DOTS = 100
# A rig has fewer than a hundred values. For each unknown key the nearest known one is looked for.
MOST_KEYS = 1000
UTF8_BOM = b"\xef\xbb\xbf"
EXPECTED = "expected a rig file (TOML)"
UTF16_BOMS = (b"\xff\xfe", b"\xfe\xff")


def read_text(path: Path) -> str:
    """Returns the content of the file as text.

    Raises
    ------
    RigError
        the path does not exist, is a directory, or cannot be read, or the text is not UTF-8.
    """
    try:
        if path.is_dir():
            raise RigError(path, [f"this is a directory: {EXPECTED}; name one in it"])
        data = read_file(path, RIG_BYTES)
    except FileNotFoundError:
        raise RigError(path, [f"there is no such file: {EXPECTED}; check the path"]) from None
    except RecordError as error:  # its message speaks of records
        mend = "name a rig file (TOML)"
        if "device" not in error.problem:
            mend = f"is it a rig file? If it is meant to be so large, {RIG_BYTES.remedy}"
        raise RigError(path, [f"{error.problem}: expected {error.expected}; {mend}"]) from None
    except RigError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise RigError(path, [f"cannot be read ({reason}): {EXPECTED}; check the path"]) from None
    if data.startswith(UTF16_BOMS):
        raise RigError(path, ["the text is UTF-16: expected UTF-8; save it as UTF-8"])
    data = data.removeprefix(UTF8_BOM)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - data.rfind(b"\n", 0, error.start)
        raise RigError(
            path,
            [
                f"line {line}, column {column}: byte 0x{data[error.start]:02x} is not UTF-8 text: "
                f"{EXPECTED}; save it as UTF-8"
            ],
        ) from None


def parse_toml(text: str, source: object) -> dict[str, Any]:
    """Returns the tables of a TOML document.

    Raises
    ------
    RigError
        the text is not TOML, and the message gives line and column of a syntax error; keys or
        brackets are nested too deeply; or there are too many keys.
    """
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > MOST_DOTS and not line.lstrip().startswith("#"):
            raise RigError(
                source,
                [
                    f"line {number}: {line.count('.')} dots: expected keys of a few parts, such as "
                    '"fluid.bulk_modulus_pa"; correct the line'
                ],
            )
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        problem = _syntax_problem(str(error), text)
    except RecursionError:
        problem = "not TOML: brackets are nested too deeply; expected the sections of docs/rigs.md"
    except ValueError:
        problem = "not TOML: a number has thousands of digits; expected numbers in SI units"
    else:
        keys = _count_keys(document)
        if keys <= MOST_KEYS:
            return document
        problem = (
            f"{keys} keys: expected at most {MOST_KEYS}, those of one machine; is it a rig file?"
        )
    raise RigError(source, [problem])


def _syntax_problem(problem: str, text: str) -> str:
    """Returns an error of the parser with its place in front and the line in question behind."""
    lines = text.split("\n")
    problem, _, place = problem.rpartition(" (at ")
    found = re.fullmatch(r"line (\d+), column (\d+)\)", place)
    line, column = (int(found[1]), int(found[2])) if found else (len(lines), len(lines[-1]) + 1)
    end = "" if found else ", the end of the file"
    written = lines[line - 1].strip() if line <= len(lines) else ""
    shown = written if len(written) <= 60 else written[:57] + "..."
    return (
        f"line {line}, column {column}{end}: not TOML: {problem}"
        + (f"; the line is {shown!r}" if shown else "")
        + ": expected [section] or key = value, each once; the value is a number with a decimal "
        "point and no unit, or text in quotation marks"
    )


def _count_keys(document: dict[str, Any]) -> int:
    """Returns the number of keys in all tables that are not in lists."""
    count, waiting = 0, [document]
    while waiting:
        table = waiting.pop()
        count += len(table)
        waiting += [value for value in table.values() if isinstance(value, dict)]
    return count
