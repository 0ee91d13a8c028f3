# SPDX-License-Identifier: MIT
"""The dated logs of machines in a folder: the date stands in the name of each file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ..records.kinds import records_in

RIG = "rig.toml"
# 2026-03-17, 20260317, 2026_03_17, with a time behind it: T0830, _08-30-15, " 08.30".
DATE = re.compile(
    r"(?<!\d)(?P<year>(?:19|20)\d\d)[-_.]?(?P<month>[01]\d)[-_.]?(?P<day>[0-3]\d)"
    r"(?:[T_ -]+(?P<hour>[0-2]\d)[-:.h]?(?P<minute>[0-5]\d)(?:[-:.m]?(?P<second>[0-5]\d))?)?(?!\d)"
)


@dataclass(frozen=True)
class DatedLog:
    """A log of a machine."""

    machine: str
    path: Path
    date: datetime
    """As in the name of the file, read as UTC; noon where it has no time."""


def date_of(name: str) -> datetime | None:
    """Returns the date in the name of a file; None where there is none, or no such day."""
    found = DATE.search(name)
    if found is None:
        return None
    numbers = {part: int(digits) for part, digits in found.groupdict().items() if digits}
    try:
        return datetime(**{"hour": 12, **numbers}, tzinfo=UTC)
    except ValueError:
        return None


def machines_in(folder: Path, rig_file: Path | None = None) -> list[Path]:
    """Returns the folders of the machines: the folder itself, or its sub-folders with a rig file.

    With `rig_file`, which may be elsewhere, it is the folder itself.

    Raises
    ------
    ValueError
        there is no such folder, or no rig file in it or directly below it.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: there is no such folder: expected one with dated logs")
    if rig_file is not None or (folder / RIG).is_file():
        return [folder]
    machines = sorted(path.parent for path in folder.glob(f"*/{RIG}"))
    if not machines:
        raise ValueError(
            f"{folder}: has no {RIG}: expected it beside the logs of a machine, or in a sub-folder "
            "for each machine; 'ehsid rig new' makes one"
        )
    return machines


def dated_logs(machine: Path) -> list[DatedLog]:
    """Returns the logs of a machine, oldest first.

    Raises
    ------
    ValueError
        there is no log, or one has no date in its name.
    """
    files = records_in(machine)
    if not files:
        raise ValueError(
            f"{machine}: has no log of a machine: expected at least one with a date in its name, "
            "such as 2026-03-17.csv"
        )
    logs, undated = [], []
    for path in files:
        date = date_of(path.name)
        if date is None:
            undated.append(path.name)
        else:
            logs.append(DatedLog(machine.resolve().name, path, date))
    if undated:
        few = ", ".join(undated[:3]) + (f" and {len(undated) - 3} more" if len(undated) > 3 else "")
        raise ValueError(
            f"{machine}: no date in the name of {few}: expected one such as 2026-03-17 or "
            "20260317T0830 in the name of each log; rename the file, or move it elsewhere"
        )
    return sorted(logs, key=lambda log: (log.date, log.path.name))
