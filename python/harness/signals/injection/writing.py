# SPDX-License-Identifier: MIT
"""Writes an injected record and its answer to files."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

from ...base.files import write_text
from ...records.writing import record_bytes
from .inject import Injected


def answer_path(path: str | os.PathLike[str]) -> Path:
    """Path of the answer of a record: in the same folder, its whole name and `.answer.json`."""
    path = Path(path)
    return path.with_name(f"{path.name}.answer.json")


def write_injected(injected: Injected, path: Path) -> None:
    """Writes the record in the format that its extension names, and the answer beside it.

    Raises
    ------
    RecordError
        the format does not allow the name of a column.
    OSError
        the file system refuses to write.
    """
    content = record_bytes(injected.record, path.name)
    path.write_bytes(content)
    plain = injected.answer.plain()
    plain["record"] = {"file": path.name, "sha256": hashlib.sha256(content).hexdigest()}
    write_text(answer_path(path), json.dumps(plain, indent=2, allow_nan=False) + "\n")
