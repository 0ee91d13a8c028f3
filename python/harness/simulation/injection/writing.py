# SPDX-License-Identifier: MIT
"""An injected record and its answer as files."""

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
    """Where the answer of a record goes: beside it, its whole name and `.answer.json`."""
    path = Path(path)
    return path.with_name(f"{path.name}.answer.json")


def write_injected(injected: Injected, path: str | os.PathLike[str]) -> Path:
    """Write the record in the format its extension names, and the answer beside it.

    The answer is written under a temporary name first and renamed when the record is there, so that
    an error leaves neither.

    Returns
    -------
    The path of the answer.

    Raises
    ------
    InjectError
        the answer cannot be written.
    RecordError
        the record cannot.
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
