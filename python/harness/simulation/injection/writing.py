# SPDX-License-Identifier: MIT
"""Writes an injected record and its answer to files."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

from ehsid.harness.files import replacing
from ehsid.harness.records import write_record
from ehsid.harness.simulation.injection.effects import InjectError
from ehsid.harness.simulation.injection.inject import Injected


def answer_path(path: str | os.PathLike[str]) -> Path:
    """Path of the answer of a record: in the same folder, its whole name and `.answer.json`."""
    path = Path(path)
    return path.with_name(f"{path.name}.answer.json")


def write_injected(injected: Injected, path: str | os.PathLike[str]) -> Path:
    """Writes the record in the format that its extension names, and the answer beside it.

    The answer first gets a temporary name and is renamed after the record is written, so that an
    error leaves neither file.

    Returns
    -------
    The path of the answer.

    Raises
    ------
    InjectError
        the answer cannot be written.
    RecordError
        the record cannot be written.
    """
    path, answer = Path(path), answer_path(path)
    try:
        with replacing(answer) as unfinished:
            unfinished.write_text("", encoding="utf-8")
            write_record(injected.record, path)
            plain = injected.answer.plain()
            plain["record"] = {
                "file": path.name,
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            }
            text = json.dumps(plain, indent=2, allow_nan=False) + "\n"
            unfinished.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InjectError(
            f"{answer}: cannot be written ({error.strerror}); name a folder that exists and may be "
            "written to"
        ) from None
    return answer
