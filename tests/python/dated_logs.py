# SPDX-License-Identifier: MIT
"""A machine with a log a week, too short to be fitted, for tests that watch machines."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

from made_diagnoses import bench, measured_record

from ehsid.harness.records import write_record
from ehsid.harness.rigs import write_rig


def write_machine(folder: Path, weeks: int) -> Path:
    """Write rig.toml and the logs of so many weeks, and return the folder."""
    folder.mkdir()
    write_rig(bench(), folder / "rig.toml")
    for week in range(weeks):
        write_log(folder, week)
    return folder


def write_log(folder: Path, week: int) -> None:
    """Write the log of a week, whose number is the last part of its name."""
    date = datetime(2026, 1, 5, tzinfo=UTC) + timedelta(weeks=week)
    record = measured_record("record", 1, seconds=1.0, dt_s=5e-3)
    write_record(record, folder / f"{date:%Y-%m-%d}-{week}.csv")
