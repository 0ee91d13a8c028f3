# SPDX-License-Identifier: MIT
"""Histories of the workbench: what is chosen, what is refused, and what a stop leaves."""

from __future__ import annotations

import multiprocessing
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from app_diagnosed import diagnosed_session
from dated_logs import write_machine
from made_diagnoses import bench
from made_history import made_history

from ehsid.harness.base.parallel import workers
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig, write_rig
from ehsid.harness.watch import watching
from ehsid.harness.watch.store import FILE, opened
from ehsid.harness.watch.tracking import Told
from ehsid.workbench.histories import NUMBERS, PAGE, Histories, HistoryChoice, history_task
from ehsid.workbench.history_view import histories_html
from ehsid.workbench.jobs import State
from ehsid.workbench.workbench import Workbench

pytestmark = pytest.mark.usefixtures("blank_pictures", "no_plots")
COUNT = 4


@pytest.fixture
def histories(tmp_path: Path) -> Iterator[Histories]:
    workbench = Workbench(tmp_path / "machines")
    made = Histories(workbench)
    yield made
    made.close()
    workbench.close()


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Logs that are too short to be fitted, which is told in a moment."""
    return write_machine(tmp_path / "press7", COUNT)


@pytest.mark.slow
def test_logs_are_fitted_in_a_process_of_its_own_and_the_choice_is_kept(
    histories: Histories, logs: Path
) -> None:
    before = {child.pid for child in multiprocessing.active_children()}  # of other tests
    assert histories.start(HistoryChoice(logs=str(logs))) == "press7"
    job = histories.job("press7")
    assert job is not None
    with pytest.raises(ValueError, match="press7: its logs are being fitted: expected one"):
        histories.start(HistoryChoice(logs=str(logs)))
    job.wait(120.0)
    after = {child.pid for child in multiprocessing.active_children()}
    assert after <= before  # it leaves no worker of its own
    assert (job.state, job.message) == (State.done, "")
    assert job.stage == f"{COUNT} of {COUNT} new logs fitted and kept."
    told = histories.told("press7")
    assert told is not None
    assert (
        list(told.machines[0].refused.values())
        == [
            "1 s without a gap are too short: the diagnosis needs 2.3 s, the first 0.3 s and 4 "
            "windows; record for longer"
        ]
        * COUNT
    )
    # The same logs are the same history, and none is fitted again; also in a later run.
    later = Histories(histories.workbench)
    assert later.names() == ["press7"]
    assert later.start(later.choice("press7")) == "press7"
    again = later.job("press7")
    assert again is not None
    again.wait(120.0)
    assert again.stage == "No log was new."


def test_a_stop_keeps_what_is_fitted_and_tells_it(
    logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitted: list[str] = []

    def estimated(record: Record, rig: Rig, effects: tuple[str, ...]) -> Told:
        fitted.append(record.name)
        return Told(refused="a stand-in")

    monkeypatch.setattr(watching, "estimated", estimated)
    out, stop, said = tmp_path / "history", threading.Event(), []

    def report(share: float, stage: str = "") -> None:
        said.append((share, stage))
        if len(fitted) == 2:
            stop.set()

    out.mkdir()
    with workers(1):
        history_task(logs, None, None, out, stop, report=report)
    assert len(fitted) == 2
    words = "2 of 4 new logs fitted and kept"
    assert said[1] == (0.5, f"{words}; the last one was 2026-01-12-1.csv")
    assert said[-1] == (1.0, f"Stopped: {words}; a new start goes on with the others.")
    assert (out / PAGE).is_file()
    with opened(out / FILE) as history:
        assert set(history.settings("press7")) == {"2026-01-05-0.csv", "2026-01-12-1.csv"}


def test_rig_and_columns_may_be_those_of_a_machine(
    histories: Histories, logs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    diagnosed_session(histories.workbench.folder / "press", "effects")
    (logs / "rig.toml").unlink()
    given = []

    class NoJob:
        running = False

        def __init__(self, what: str, task: object, *args: object, **about: object) -> None:
            given.append(args)

    monkeypatch.setattr("ehsid.workbench.histories.Job", NoJob)
    with pytest.raises(ValueError, match=r"has no rig\.toml: expected it beside the logs"):
        histories.start(HistoryChoice(logs=str(logs)))
    assert histories.names() == []
    assert histories.start(HistoryChoice(logs=str(logs), machine="press")) == "press7"
    ((folder, rig, *_),) = given
    assert (folder, rig) == (logs, histories.workbench.folder / "press" / "rig.toml")
    # Another folder of this name is another history.
    other = logs.parent / "elsewhere" / "press7"
    shutil.copytree(logs, other)
    assert histories.start(HistoryChoice(logs=str(other), machine="press")) == "press7_2"


def test_an_earlier_history_is_shown_and_told_among_the_machines(
    histories: Histories, tmp_path: Path
) -> None:
    made_history(tmp_path / "history")
    assert "Begin a new history" in histories_html(histories, "light")
    assert histories.show(f" {tmp_path / 'history'} ") == "press7"
    assert histories.show(str(tmp_path / "history")) == "press7"
    told = histories.told("press7")
    assert told is not None
    assert [one.name for one in told.machines[0].changed] == [
        "effects.internal_leakage.coefficient_m3_s_pa",
        "effects.valve_dead_band.overlap",
    ]
    assert len(told.machines[0].oil_temperature) == 52
    listed = histories_html(histories, "dark")
    assert "52 logs fitted with the same effects. 3 changes." in listed
    assert "/history?name=press7&amp;theme=dark" in listed


@pytest.mark.parametrize(
    ("choice", "says"),
    [
        (HistoryChoice(), "folder of dated logs: nothing is given: expected one with logs such as"),
        (HistoryChoice(logs="nowhere"), "nowhere: there is no such folder: expected one with"),
        (HistoryChoice(logs="press7", out="press7/history"), "lies in the folder of the logs"),
        (HistoryChoice(logs="empty"), "empty: has no log of a machine: expected at least one with"),
        (HistoryChoice(logs="undated"), "undated: no date in the name of run7.csv: expected one"),
    ],
)
def test_what_cannot_be_watched_is_said_and_nothing_is_written(
    histories: Histories,
    logs: Path,
    choice: HistoryChoice,
    says: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(logs.parent)
    for folder in ("empty", "undated"):
        Path(folder).mkdir()
        write_rig(bench(), Path(folder) / "rig.toml")
    shutil.copyfile(min(logs.glob("*.csv")), Path("undated/run7.csv"))
    with pytest.raises(ValueError, match=says):
        histories.start(choice)
    assert histories.names() == []


def test_a_folder_without_a_history_is_refused(histories: Histories, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="folder of the history: nothing is given: expected the"):
        histories.show(" ")
    (tmp_path / PAGE).write_text("mine")
    (tmp_path / NUMBERS).write_text("{}")
    with pytest.raises(ValueError, match=r"has no history: expected watch\.html and watch\.json"):
        histories.show(str(tmp_path))
    assert histories.names() == []
