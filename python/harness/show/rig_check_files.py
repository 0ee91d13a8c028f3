# SPDX-License-Identifier: MIT
"""The table of a check of a rig against records, and its files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..base.encoding import json_text
from ..base.files import write_text
from ..fitness import Finding, RecordCheck, rig_check_file
from ..rigs import Rig
from .page import Table, Tagged

KINDS = {"fits": "good", "does not fit": "bad", "cannot be told": "soft"}


def check_table(findings: Sequence[Finding]) -> Table:
    """Returns the outcome of each check, and the reason."""
    rows = [
        (one.check, Tagged(str(one.status), kind=KINDS[one.status]), one.text) for one in findings
    ]
    return Table("", ("check", "outcome", "why"), rows)


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
