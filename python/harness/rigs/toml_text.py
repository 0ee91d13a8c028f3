# SPDX-License-Identifier: MIT
"""Reads the text of a TOML file and parses its tables; reports the errors in the file."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from ehsid.harness.records import RecordError
from ehsid.harness.records.limits import Limit, read_file
from ehsid.harness.rigs.errors import RigError

RIG_BYTES = Limit("EHSID_MAX_RIG_BYTES", 2**20, "bytes in a rig file")
# More dots than this are in no key of a rig. The parser takes time with the square of their number.
MOST_DOTS = 100
UTF8_BOM = b"\xef\xbb\xbf"
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
            raise RigError(path, ["this is a directory; name a rig file (TOML) in it"])
        data = read_file(path, RIG_BYTES)
    except FileNotFoundError:
        raise RigError(path, ["there is no such file"]) from None
    except RecordError as error:  # the limits speak of records
        raise RigError(path, [f"{error.problem}; expected {error.expected}"]) from None
    except RigError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise RigError(path, [f"cannot be read ({reason})"]) from None
    if data.startswith(UTF16_BOMS):
        raise RigError(path, ["the text is UTF-16; save it as UTF-8"])
    data = data.removeprefix(UTF8_BOM)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - data.rfind(b"\n", 0, error.start)
        raise RigError(
            path,
            [
                f"line {line}, column {column}: byte 0x{data[error.start]:02x} is not UTF-8 text; "
                "save it as UTF-8"
            ],
        ) from None


def parse_toml(text: str, source: object) -> dict[str, Any]:
    """Returns the tables of a TOML document.

    Raises
    ------
    RigError
        the text is not TOML, and the message gives line and column of a syntax error; or keys or
        brackets are nested too deeply.
    """
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > MOST_DOTS and not line.lstrip().startswith("#"):
            raise RigError(
                source,
                [f"line {number}: {line.count('.')} dots; expected keys of a few parts"],
            )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        lines = text.split("\n")
        end = f"at line {len(lines)}, column {len(lines[-1]) + 1}, the end of the file"
        problem = str(error).replace("at end of document", end)
    except RecursionError:
        problem = "brackets are nested too deeply"
    except ValueError as error:  # an integer has more digits than Python converts
        problem = str(error).split(";")[0]
    raise RigError(source, [f"not TOML: {problem}"])
