# SPDX-License-Identifier: MIT
"""Work in processes: how it goes on, ends well or badly, is cancelled, and is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ehsid.workbench.jobs import Job, Report, State

pytestmark = pytest.mark.slow

WAIT_S = 60.0


def well(path: Path, *, report: Report) -> None:
    for share, stage in ((0.25, "fitting"), (0.5, ""), (0.75, "writing")):
        report(share, stage)
        time.sleep(0.05)
    path.write_text("done")


def badly(*, report: Report) -> None:
    raise ValueError("rec.csv, row 7: expected a number; correct it")


def wrongly(*, report: Report) -> None:
    raise KeyError("a fault")


def for_ever(path: Path, *, report: Report) -> None:
    path.write_text(str(os.getpid()))
    report(0.5)
    time.sleep(600.0)


def started(
    tmp_path: Path, task: Callable[..., None], *args: object
) -> tuple[Job, list[tuple[float, str]]]:
    """A job, and the shares and stages that it has told."""
    told: list[tuple[float, str]] = []
    job: list[Job] = []
    made = Job(
        "reading run1",
        task,
        *args,
        log=tmp_path / "errors.log",
        changed=lambda: told.extend((one.share, one.stage) for one in job),
    )
    job.append(made)
    return made, told


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_job_goes_on_and_ends(tmp_path: Path) -> None:
    job, told = started(tmp_path, well, tmp_path / "result")
    job.wait(WAIT_S)
    assert job.state is State.done
    assert (tmp_path / "result").read_text() == "done"
    # A stage is told until the next one begins.
    assert told[-1] == (1.0, "writing")
    assert not {(0.5, ""), (0.75, "fitting")} & set(told)
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert {0.25, 0.5, 0.75, 1.0} <= set(shares)
    assert job.left_s is None


def test_bad_input_is_told_in_its_own_words(tmp_path: Path) -> None:
    job, _ = started(tmp_path, badly)
    job.wait(WAIT_S)
    assert (job.state, job.message) == (
        State.failed,
        "rec.csv, row 7: expected a number; correct it",
    )
    assert not (tmp_path / "errors.log").exists()


def test_a_fault_of_the_program_goes_to_the_log_and_not_to_the_page(tmp_path: Path) -> None:
    job, _ = started(tmp_path, wrongly)
    job.wait(WAIT_S)
    assert job.state is State.failed
    assert "Traceback" not in job.message
    assert str(tmp_path / "errors.log") in job.message
    assert "KeyError" in (tmp_path / "errors.log").read_text()


def test_a_job_is_cancelled_and_its_process_ends(tmp_path: Path) -> None:
    job, _ = started(tmp_path, for_ever, tmp_path / "pid")
    until(lambda: job.share == 0.5)
    assert job.left_s is not None
    job.cancel()
    assert (job.state, job.message) == (State.cancelled, "")
    pid = int((tmp_path / "pid").read_text())
    assert not _alive(pid)
    job.wait(WAIT_S)
    assert job.state is State.cancelled


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_lost_worker_is_told(tmp_path: Path) -> None:
    job, _ = started(tmp_path, for_ever, tmp_path / "pid")
    until(lambda: job.share == 0.5)
    assert job.pid is not None
    os.kill(job.pid, signal.SIGKILL)
    job.wait(WAIT_S)
    assert job.state is State.lost
    assert job.message.startswith("reading run1: the process that did the work has ended")


PARENT = """
import sys, time
from pathlib import Path
sys.path.insert(0, {here!r})
from test_jobs import for_ever
from ehsid.workbench.jobs import Job
if __name__ == "__main__":
    path = Path({path!r})
    Job("x", for_ever, path, log=path, changed=lambda: None)
    time.sleep(600)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_worker_ends_with_the_process_that_started_it(tmp_path: Path) -> None:
    path, script = tmp_path / "pid", tmp_path / "parent.py"
    script.write_text(PARENT.format(here=str(Path(__file__).parent), path=str(path)))
    parent = subprocess.Popen([sys.executable, str(script)])
    try:
        until(lambda: path.exists() and path.read_text() != "")
    finally:
        parent.kill()
        parent.wait()
    until(lambda: not _alive(int(path.read_text())))


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        # A process that has ended, and that nobody has waited for, still has a number.
        state = Path(f"/proc/{pid}/stat")
        return not state.exists() or state.read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
