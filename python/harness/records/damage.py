# SPDX-License-Identifier: MIT
"""Error message for a file that its reader cannot interpret."""

from __future__ import annotations

from pathlib import Path

from ehsid.harness.records.errors import RecordError


def first_line(error: BaseException) -> str:
    """Returns the first line of an error's message without the full stop, or else its type."""
    return (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".")


def damaged(path: Path, kind: str, error: BaseException) -> RecordError:
    """Returns the error for a file of the given kind that its reader refused with `error`."""
    return RecordError(
        path,
        f"this is not a readable {kind} file ({first_line(error)})",
        expected=f"a {kind} file, as its name says",
        mend="export it again, or give it the extension of its real format",
    )
