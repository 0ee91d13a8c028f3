# SPDX-License-Identifier: MIT
"""Files that appear whole or not at all: written under a name beside their own, then renamed."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a name in the same folder to write to; when the block ends well it becomes `path`.

    An error in the block, or one of the file system, leaves what stood at `path` as it was and
    nothing beside it. Readers see the old file or the new one, never a part. Two writers do not
    disturb each other: the last one to end is the one that stays.

    Raises
    ------
    OSError
        the folder is not there, or the file system refuses the new name.
    """
    unfinished = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        yield unfinished
        unfinished.replace(path)
    except BaseException:
        with suppress(OSError, ValueError):  # ValueError: a zero byte in the path
            unfinished.unlink()
        raise


def write_text(path: Path, text: str) -> None:
    """Write a text file as UTF-8 with line feeds, whole or not at all.

    Raises
    ------
    OSError
        as `replacing`.
    """
    with replacing(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8", newline="\n")
