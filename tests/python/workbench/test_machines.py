# SPDX-License-Identifier: MIT
"""Machines side by side: what each row says, and how machines are renamed and removed."""

from __future__ import annotations

from pathlib import Path

import pytest
from app_diagnosed import diagnosed_session
from app_sessions import german_log

from ehsid.workbench.machines import MachineRow, machine_rows
from ehsid.workbench.session import Session, SessionError
from ehsid.workbench.workbench import REMOVED, Workbench


@pytest.fixture
def workbench(tmp_path: Path) -> Workbench:
    diagnosed_session(tmp_path / "press", "effects")
    return Workbench(tmp_path)


def row(workbench: Workbench, name: str) -> MachineRow:
    return next(one for one in machine_rows(workbench) if one.name == name)


def test_a_diagnosed_machine_says_verdict_gaps_and_part(workbench: Workbench) -> None:
    found = row(workbench, "press")
    assert (found.records, found.holds) == (1, True)
    assert "friction" in found.verdict
    assert found.before is not None
    assert found.after is not None
    assert found.before > found.after > 0.0
    assert found.where == "mechanics"
    assert found.share is not None
    assert 0.5 < found.share <= 1.0
    assert found.made is not None


def test_a_verdict_that_no_longer_holds_is_marked(workbench: Workbench) -> None:
    session = workbench.opened("press")
    session.rig_file.write_text(session.rig_file.read_text() + "\n# changed\n")
    assert not row(workbench, "press").holds


def test_machines_without_a_diagnosis_and_damaged_ones_are_listed(workbench: Workbench) -> None:
    workbench.begun("new")
    (workbench.folder / "broken").mkdir()
    (workbench.folder / "broken" / "session.toml").write_text("records = 3")
    assert row(workbench, "new").verdict == "Not diagnosed yet; it stands at Load"
    broken = row(workbench, "broken")
    assert broken.records is None
    assert "not the file of a session" in broken.verdict


def test_a_renamed_machine_keeps_all_it_has(workbench: Workbench) -> None:
    session = workbench.opened("press")
    (session.folder / "package").mkdir()
    assert workbench.rename("press", " Presse 8 ") == "Presse_8"
    assert workbench.names() == ["Presse_8"]
    assert workbench.opened("Presse_8") is session
    assert session.name == "Presse_8"
    assert row(workbench, "Presse_8").holds
    assert not (session.folder / "package").exists()
    assert workbench.rename("Presse_8", "presse_8") == "presse_8"  # its own name is free to it


@pytest.mark.parametrize("wish", ["", "  ", "Other", "removed", "note.txt"])
def test_a_name_that_is_taken_or_none_is_refused(workbench: Workbench, wish: str) -> None:
    workbench.begun("other")
    (workbench.folder / "note.txt").touch()
    with pytest.raises(SessionError, match="choose another name"):
        workbench.rename("press", wish)
    assert set(workbench.names()) == {"press", "other"}


def test_a_removed_machine_is_kept_aside_and_its_name_is_free(workbench: Workbench) -> None:
    session = workbench.opened("press")
    place = workbench.remove("press")
    assert place == workbench.folder / REMOVED / "press"
    assert workbench.names() == []
    workbench.pack(session)  # a page that still shows it starts nothing
    assert workbench.job(session, "package") is None
    assert Session(place).settings.records
    assert workbench.begun("press").settings.records == []
    assert workbench.remove("press").name == "press_2"
    with pytest.raises(SessionError, match="reload the page"):
        workbench.remove("press")


def test_a_machine_at_work_stays_where_it_is(workbench: Workbench, tmp_path: Path) -> None:
    session = workbench.begun("busy")
    workbench.read(session, session.add(german_log(tmp_path / "run.csv", 1.0)))
    try:
        for change in (lambda: workbench.remove("busy"), lambda: workbench.rename("busy", "x")):
            with pytest.raises(SessionError, match="work is under way"):
                change()
    finally:
        workbench.close()
    assert "busy" in workbench.names()


def test_no_new_machine_is_called_as_the_folder_of_the_removed_ones(tmp_path: Path) -> None:
    assert Workbench(tmp_path).begun(REMOVED).name == "removed_2"
