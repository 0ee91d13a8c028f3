# SPDX-License-Identifier: MIT
"""A user's simulator as an FMU and in Python, with its rig files; FMUs with other descriptions."""

from __future__ import annotations

import sys
import tomllib
import zipfile
from pathlib import Path
from platform import machine
from typing import Any

import pytest
import tomli_w

FOLDER = Path(__file__).parent / "data" / "user_simulator"

# The libraries in the FMUs of the tests are for this platform only.
RUNS = sys.platform == "linux" and machine() == "x86_64"
needs_linux64 = pytest.mark.skipif(not RUNS, reason="the FMUs of the tests are for linux64 only")


def rig_document(name: str = "rig.toml") -> dict[str, Any]:
    """The rig file as tables, with the paths of the test data."""
    document = tomllib.loads((FOLDER / name).read_text(encoding="utf-8"))
    section = document["simulator"]
    for key in ("fmu", "python"):
        if key in section:
            section[key] = str(FOLDER / section[key])
    return document


def text_of(document: dict[str, Any]) -> str:
    return tomli_w.dumps(document)


def description_of(fmu: str = "bench.fmu") -> str:
    with zipfile.ZipFile(FOLDER / fmu) as archive:
        return archive.read("modelDescription.xml").decode()


def fmu_with(
    path: Path,
    description: str | bytes | None,
    *,
    of: str = "bench.fmu",
    binaries: bool = True,
    more: dict[str, bytes] | None = None,
) -> Path:
    """Write an FMU with another description, without its libraries, or with more files."""
    with zipfile.ZipFile(FOLDER / of) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if name == "modelDescription.xml" or (name.startswith("binaries") and not binaries):
                continue
            new.writestr(name, old.read(name))
        if description is not None:
            new.writestr("modelDescription.xml", description)
        for name, data in (more or {}).items():
            new.writestr(name, data)
    return path
