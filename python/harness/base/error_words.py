# SPDX-License-Identifier: MIT
"""Errors as messages for people: what is wrong, what was expected, and how to mend it.

Text of others, such as names of rigs and records, as it may be shown.
"""

from __future__ import annotations

import shlex
import sys
import traceback
import unicodedata
from types import FrameType

from .surroundings import STDOUT

# How the messages begin that pybind11 gives to values which a C++ type cannot hold.
OF_PYBIND = ("incompatible function arguments", "incompatible constructor arguments")


def error_words(error: BaseException) -> str | None:
    """Returns the message of an error that is due to the input; None for a fault of the program.

    The errors of records, rigs, identification and simulation are all ValueErrors; one that a
    library raises is none of them. The others come from numbers, sizes and nesting that no check
    has foreseen.
    """
    if isinstance(error, ValueError):
        return None if _of_a_library(error) else str(error)
    if isinstance(error, OSError):
        return _of_the_system(error)
    if isinstance(error, MemoryError):
        why = str(error).rstrip(".") or "no more memory"
        return (
            f"the memory of this machine is not enough ({why}): expected a smaller task; "
            "take shorter records or signals, a longer sampling time, or fewer --workers"
        )
    if isinstance(error, OverflowError):
        return (
            f"a number is too large to compute with ({error}): expected ordinary numbers in SI "
            "units; check the options and the rig file"
        )
    if isinstance(error, RecursionError):
        return (
            "the input is nested too deeply: expected the few levels of the documented formats; "
            "check the files that were given"
        )
    if isinstance(error, TypeError) and any(words in str(error) for words in OF_PYBIND):
        return (
            f"a number does not fit its type ({str(error).splitlines()[0]}): expected whole "
            "numbers below 2^31 and finite real numbers; check the options"
        )
    return None


def fault_words(error: BaseException) -> str:
    """Returns a fault of the program as one line: what and where it is, and what to send."""
    own = [
        f"{frame.f_globals['__name__']}, line {line}"
        for frame, line in traceback.walk_tb(error.__traceback__)
        if _package(frame) == "ehsid"
    ]
    place = f" in {own[-1]}" if own else ""
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return (
        f"a fault of the program{place} ({what}), which is not due to your data: please report it "
        "with the command, its files, the answer of ehsid --version, and what -v adds"
    )


def _of_a_library(error: ValueError) -> bool:
    """Whether an installed library has made this error: its class, or the raise itself."""
    module = sys.modules.get(type(error).__module__)
    if _installed(getattr(module, "__file__", None)) and module is not None:
        return module.__name__.partition(".")[0] != "ehsid"
    last = [frame for frame, _ in traceback.walk_tb(error.__traceback__)][-1:]
    return any(_installed(one.f_code.co_filename) and _package(one) != "ehsid" for one in last)


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


def _installed(file: str | None) -> bool:
    return file is not None and ("site-packages" in file or "dist-packages" in file)


def _of_the_system(error: OSError) -> str:
    """Returns an error of the operating system as a message that names the file."""
    if error.filename == STDOUT:
        return (
            f"what is printed cannot be written to stdout ({error.strerror}): expected a terminal, "
            "a pipe, or a file on a disk with room. Only the printed lines are lost: result files "
            "that were finished before are whole"
        )
    if error.filename is None or error.strerror is None:
        return str(error)
    return (
        f"{error.filename}: cannot be used ({error.strerror}): expected a path that can be read, "
        "or written to; check it, and its permissions"
    )


def install_line(extra: str) -> str:
    """Returns the line that installs the packages of an extra where this Python finds ehsid.

    It names the Python that runs: a plain `pip` may belong to another one.
    """
    return f"{shlex.quote(sys.executable)} -m pip install 'ehsid[{extra}]'"


def printable(text: str) -> str:
    r"""Returns the text with control characters written out, such as \x1b.

    These are also the characters that change the direction of writing, with which a name can look
    like another one. Line ends and spaces of all kinds stay.
    """

    def harmless(c: str) -> bool:
        return c.isprintable() or c == "\n" or unicodedata.category(c) == "Zs"

    return "".join(c if harmless(c) else repr(c)[1:-1] for c in text)
