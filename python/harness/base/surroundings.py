# SPDX-License-Identifier: MIT
"""What a command does not take from the place where it is started."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import Any

STDOUT = "<stdout>"
SIZES = ("COLUMNS", "LINES", "TERMINAL_WIDTH")
LEAST, MOST = 20, 1000  # columns in which text can be read


class _Stdout(io.FileIO):
    """Names itself in its errors, so that they are not taken for those of a result file."""

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            error.filename = STDOUT
            with Path(os.devnull).open("wb") as nowhere:  # Python tries the rest again at its end
                os.dup2(nowhere.fileno(), self.fileno())
            raise


def settle() -> None:
    """Opens streams that are closed, and drops settings with which nothing could be read."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            # It takes the free number of the stream, which the next file would have got otherwise,
            # together with all text for the stream.
            mode = "r" if name == "stdin" else "w"
            stream = Path(os.devnull).open(mode, encoding="utf-8")  # noqa: SIM115 -- for good
            if stream.fileno() == number:
                os.set_inheritable(number, True)
            setattr(sys, name, stream)
        elif name == "stdout" and sys.platform != "win32":  # whose consoles are no files
            before = sys.stdout
            sys.stdout = io.TextIOWrapper(
                io.BufferedWriter(_Stdout(before.fileno(), "w", closefd=False)),
                encoding=before.encoding,
                errors=before.errors,
                line_buffering=bool(before.line_buffering),
            )
    for name in SIZES:
        size = os.environ.get(name, "")
        if size and not (size.isdecimal() and len(size) < 5 and LEAST <= int(size) <= MOST):
            del os.environ[name]
    # Pictures look the same everywhere. A style can also name programs such as TeX, which are run.
    os.environ["MATPLOTLIBRC"] = os.devnull
