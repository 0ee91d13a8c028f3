# SPDX-License-Identifier: MIT
"""A worker that is killed within a log takes nothing of what was fitted with it."""

from __future__ import annotations

import os
import signal
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from made_diagnoses import bench, measured_record

from ehsid.harness.base.parallel import run_unordered, workers
from ehsid.harness.records import Record, write_record
from ehsid.harness.rigs import Rig, write_rig
from ehsid.harness.watch.store import FILE, History, opened
from ehsid.harness.watch.watching import fits_of_new, logs_in

COUNT = 8


def killing_read(path: Path, rig: Rig) -> Record:
    """Kills its process at one log, as a lack of memory would, while the mark is there."""
    if path.stem.endswith("-5") and (path.parent.parent / "kills").is_file():
        os.kill(os.getpid(), signal.SIGKILL)
    raise ValueError("not read, which is told as well, and is quick")


def fit_all(folder: Path, history: History) -> None:
    with workers(2):
        for fit in run_unordered(fits_of_new(logs_in(folder), history, killing_read)):
            history.add(fit)


@pytest.mark.slow
def test_what_was_fitted_before_a_kill_is_kept_and_the_rest_goes_on(tmp_path: Path) -> None:
    folder = tmp_path / "press7"
    folder.mkdir()
    write_rig(bench(), folder / "rig.toml")
    record = measured_record("record", 1, seconds=1.0, dt_s=5e-3)
    for week in range(COUNT):
        date = datetime(2026, 1, 5, tzinfo=UTC) + timedelta(weeks=week)
        write_record(record, folder / f"{date:%Y-%m-%d}-{week}.csv")
    (tmp_path / "kills").touch()
    with opened(tmp_path / FILE) as history:
        with pytest.raises(ChildProcessError, match="a worker process was killed"):
            fit_all(folder, history)
        kept = history.settings("press7")
        assert 0 < len(kept) < COUNT
        assert not [name for name in kept if name.endswith("-5.csv")]
        (tmp_path / "kills").unlink()
        fit_all(folder, history)
        assert len(history.settings("press7")) == COUNT
