# SPDX-License-Identifier: MIT
"""The workbench reads logs one after the other, and notes what results were made of."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from app_sessions import BENCH, entry_of, german_log

from ehsid.workbench.flow import step_states
from ehsid.workbench.jobs import State
from ehsid.workbench.reading import reading_of
from ehsid.workbench.session import Session
from ehsid.workbench.workbench import Workbench


@pytest.fixture
def workbench(tmp_path: Path) -> Iterator[Workbench]:
    made = Workbench(tmp_path / "machines")
    yield made
    made.close()


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 120.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_the_first_session_is_begun_and_then_opened_again(workbench: Workbench) -> None:
    first = workbench.latest()
    assert first.name == "machine"
    other = workbench.begun("Presse 7/a")
    assert (other.name, workbench.begun("").name) == ("a", "machine_2")
    os.utime(first.folder / "session.toml", (2e9, 2e9))
    assert workbench.latest() is first
    assert set(workbench.names()) == {"machine", "a", "machine_2"}


@pytest.mark.slow
def test_a_machine_whose_folder_was_removed_begins_anew(workbench: Workbench) -> None:
    session = workbench.latest()
    log = german_log(session.folder.parent / "run.csv", 0.5)
    workbench.read(session, session.add(log))
    job = workbench.job(session, "read")
    shutil.rmtree(session.folder)
    again = workbench.latest()
    assert again is not session
    assert again.settings.records == []
    assert job is not None
    assert not job.running
    assert workbench.job(again, "read") is None
    workbench.read(again, again.add(log))  # the end of the other job does not stand in the way
    until(lambda: reading_of(again, entry_of(again)) is not None)


@pytest.mark.thorough
def test_a_page_of_a_machine_that_has_gone_does_not_keep_its_namesake_from_reading(
    workbench: Workbench,
) -> None:
    gone = workbench.latest()
    log = german_log(gone.folder.parent / "run.csv", 0.5)
    entry = gone.add(log)
    shutil.rmtree(gone.folder)
    again = workbench.latest()
    workbench.read(gone, entry)  # a tab that was not closed
    workbench.read(again, again.add(log))
    until(lambda: reading_of(again, entry_of(again)) is not None)


def test_a_session_that_was_edited_is_read_again(workbench: Workbench) -> None:
    session = workbench.latest()
    file = session.folder / "session.toml"
    assert workbench.latest() is session
    file.write_text(file.read_text().replace('plant = "ehs"', 'plant = "axis"'))
    assert session.settings.rig.plant == "ehs"
    assert workbench.latest().settings.rig.plant == "axis"


def test_a_name_cannot_lead_out_of_the_folder(workbench: Workbench) -> None:
    assert workbench.opened("../../x").folder.parent == workbench.folder


@pytest.mark.thorough
def test_logs_are_read_and_the_check_follows(workbench: Workbench, tmp_path: Path) -> None:
    session = workbench.latest()
    for number in range(2):
        log = german_log(tmp_path / f"run{number}.csv", 1.0, float(number))
        workbench.read(session, session.add(log))
    until(lambda: not workbench.is_reading(session))
    assert all(reading_of(session, entry) for entry in session.settings.records)
    session.rig_file.write_bytes(BENCH.read_bytes())
    workbench.check(session)
    workbench.check(session)  # a second one is not started beside it
    job = workbench.job(session, "check")
    assert job is not None
    job.wait(120.0)
    assert (job.state, job.message) == (State.done, "")
    until(lambda: step_states(session)["check"].done)
    assert Session(session.folder).settings.made_of.keys() == {"check"}


def test_closing_ends_what_is_at_work(workbench: Workbench, tmp_path: Path) -> None:
    session = workbench.latest()
    workbench.read(session, session.add(german_log(tmp_path / "run.csv", 1.0)))
    session.rig_file.write_bytes(BENCH.read_bytes())
    workbench.close()
    job = workbench.job(session, "read")
    assert job is not None
    assert not job.running
    workbench.read(session, entry_of(session))
    assert workbench.job(session, "read") is job
