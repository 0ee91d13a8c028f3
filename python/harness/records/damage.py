# SPDX-License-Identifier: MIT
"""The message for a file that its reader cannot make sense of."""

from __future__ import annotations

from pathlib import Path

from ehsid.harness.records.errors import RecordError


def first_line(error: BaseException) -> str:
    """The first line of its message, without the full stop; its type where it has none."""
    return (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".")


def damaged(path: Path, kind: str, error: BaseException) -> RecordError:
    """The error for a file of this kind that its reader refused with `error`."""
    return RecordError(
        path,
        f"this is not a readable {kind} file ({first_line(error)})",
        expected=f"a {kind} file, as its name says",
        mend="export it again, or give it the extension of its real format",
    )
