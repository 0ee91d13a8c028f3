# SPDX-License-Identifier: MIT
"""Which file of a user's simulator the text of a rig file names."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w


def stated_program(text: str) -> tuple[str, str]:
    """Returns the key and the text of the simulator's file; ("", "") where there is none.

    A module of Python that is installed is no file. A text that is no TOML names nothing.
    """
    try:
        document: Mapping[str, Any] = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return "", ""
    section = document.get("simulator")
    if not isinstance(section, dict):
        return "", ""
    for key in ("fmu", "python"):
        value = section.get(key)
        if isinstance(value, str) and (key == "fmu" or file_of(value).suffix == ".py"):
            return key, value
    return "", ""


def file_of(stated: str) -> Path:
    """Returns the path in FILE.fmu or FILE.py:NAME."""
    file, colon, _ = stated.rpartition(":")
    return Path(file if colon and file.endswith(".py") else stated)


def with_program(text: str, path: str) -> str:
    """Returns the text with another path of the simulator's file; comments stay if possible."""
    key, stated = stated_program(text)
    now = path + stated[len(str(file_of(stated))) :]
    for quoted in (json.dumps(stated), f"'{stated}'"):
        changed = text.replace(quoted, json.dumps(now, ensure_ascii=False), 1)
        if stated_program(changed) == (key, now):
            return changed
    document = tomllib.loads(text)
    document["simulator"][key] = now
    return tomli_w.dumps(document)


def stamp_of_program(rig_file: Path) -> bytes:
    """Returns what tells one version of the simulator's file from another; b"" without a file."""
    text = rig_file.read_text(encoding="utf-8", errors="replace")
    _, stated = stated_program(text)
    try:
        known = (rig_file.parent / file_of(stated)).stat() if stated else None
    except OSError:
        return b"missing"
    return b"" if known is None else f"{known.st_size} {known.st_mtime_ns}".encode()
