# SPDX-License-Identifier: MIT
"""Writes the files of a check of a rig against records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..base.encoding import json_text
from ..base.files import write_text
from ..fitness import RecordCheck, rig_check_file
from ..rigs import Rig


def pictures_of(records: int) -> list[str]:
    """Returns the names of the pictures for a number of records."""
    return [f"rig_check_{i + 1}.png" for i in range(records)]


def files_of(records: int) -> list[str]:
    """Returns the names of all files for a number of records."""
    return ["rig_check.json", *pictures_of(records)]


def write_rig_check(folder: Path, rig: Rig, checks: Sequence[RecordCheck]) -> None:
    """Writes rig_check.json and a picture of each record into a folder that exists."""
    # matplotlib takes a second to import, and the names of the files are needed without pictures.
    from .rig_check_figure import rig_check_figure

    write_text(folder / "rig_check.json", json_text(rig_check_file(rig.name, checks)))
    for name, check in zip(pictures_of(len(checks)), checks, strict=True):
        rig_check_figure(check).savefig(folder / name, dpi=120, format="png")
