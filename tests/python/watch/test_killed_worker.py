# SPDX-License-Identifier: MIT
"""A log that kills its process is told as such, and the others are fitted; also on a cluster."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from dated_logs import write_machine
from made_diagnoses import measured_record
from typer.testing import CliRunner

from ehsid.harness.base.parallel import workers
from ehsid.harness.cli import cli
from ehsid.harness.records import Record, write_record
from ehsid.harness.rigs import Rig
from ehsid.harness.watch.store import FILE, opened
from ehsid.harness.watch.watching import (
    KILLED,
    Read,
    fit_and_keep,
    logs_in,
    new_logs,
    watched,
)

COUNT = 8
KILLER, NAMED = "2026-02-09-5.csv", "2026-01-12-1.csv"
QUICK = "not read, which is told as well, and is quick"


def killing_read(path: Path, rig: Rig) -> Record:
    """Kills its process at one log, as a lack of memory would."""
    if path.name == KILLER:
        time.sleep(0.5)  # a worker of a cluster that is killed while it starts ends its nanny, too
        os.kill(os.getpid(), signal.SIGKILL)
    if path.name == NAMED:
        raise ValueError(f"{path}: has no columns")
    raise ValueError(QUICK)


def killing_read_once(path: Path, rig: Rig) -> Record:
    """Does so as long as the mark is there, and takes the mark away."""
    mark = path.parent.parent / "kills"
    if path.name == KILLER and mark.is_file():
        mark.unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    raise ValueError(QUICK)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    return write_machine(tmp_path / "press7", COUNT)


def fit_all(folder: Path, read: Read = killing_read) -> dict[str, str]:
    """Return why each log tells nothing, of those that were fitted now."""
    with opened(folder.parent / FILE) as history:
        new = new_logs(logs_in(folder), history)
        return {one.log.path.name: one.told.refused for one in fit_and_keep(new, history, read)}


def told(folder: Path) -> dict[str, str]:
    """Return the same of all logs that are in the history."""
    names = [path.name for path in folder.iterdir()]
    with opened(folder.parent / FILE) as history:
        return dict(watched("press7", history.rows("press7", names)).refused)


def check_one_is_lost(machine: Path, fitted: dict[str, str]) -> None:
    assert fitted.pop(KILLER) == KILLED
    assert fitted.pop(NAMED) == f"{machine / NAMED}: has no columns"
    assert list(fitted.values()) == [QUICK] * (COUNT - 2)
    assert told(machine) == {KILLER: KILLED, NAMED: f"{machine / NAMED}: has no columns"} | fitted


@pytest.mark.slow
def test_a_log_that_kills_its_processes_does_not_end_the_others(machine: Path) -> None:
    with workers(2):
        check_one_is_lost(machine, fit_all(machine))
        assert fit_all(machine) == {}
        with (machine / KILLER).open("a") as file:
            file.write("\n")
        assert fit_all(machine, killing_read_once) == {KILLER: QUICK}


@pytest.mark.slow
def test_a_process_that_is_killed_once_costs_nothing(machine: Path) -> None:
    mark = machine.parent / "kills"
    mark.touch()
    with workers(2):
        assert set(fit_all(machine, killing_read_once).values()) == {QUICK}
    assert not mark.exists()


@pytest.mark.thorough
def test_a_cluster_gives_the_history_of_this_computer(machine: Path, dask_cluster: str) -> None:
    for path in sorted(machine.glob("*.csv"))[2:]:
        path.unlink()
    for path in machine.glob("*.csv"):
        write_record(measured_record("record", 1, seconds=3.0, dt_s=5e-3), path)
    for number, options in enumerate((["--dask", dask_cluster], ["--workers", "1"])):
        words = ["watch", str(machine), "--out", str(machine.parent / f"history{number}")]
        done = CliRunner().invoke(cli, [*words, *options, "--track", "coulomb_friction"])
        assert done.exit_code == 0, done.output
    one, other = (machine.parent / f"history{number}" / "watch.json" for number in range(2))
    assert '"logs": 2' in one.read_text(encoding="utf-8")
    assert one.read_bytes() == other.read_bytes()
