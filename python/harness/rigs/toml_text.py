# SPDX-License-Identifier: MIT
"""Reads the text of a TOML file and parses its tables; reports the errors in the file."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from ehsid.harness.rigs.errors import RigError

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
        data = path.read_bytes()
    except FileNotFoundError:
        raise RigError(path, ["there is no such file"]) from None
    except IsADirectoryError:
        raise RigError(path, ["this is a directory; name a rig file (TOML) in it"]) from None
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
        the text is not TOML; the message gives line and column of a syntax error.
    """
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
