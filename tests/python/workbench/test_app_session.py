# SPDX-License-Identifier: MIT
"""A session is a folder: it opens again, and nothing that others named gets out of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.workbench.session import (
    LONGEST_NAME,
    MOST_RECORDS,
    SETTINGS,
    Entry,
    Session,
    SessionError,
    free_name,
    safe_name,
)

HOSTILE = [
    "../../etc/passwd",
    "..",
    "",
    "a/b\\c.csv",
    "con.csv",
    "\x00\x1b[2J",
    "x" * 500,
    ".ehsid",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_name_becomes_a_plain_one(name: str, tmp_path: Path) -> None:
    safe = safe_name(name)
    path = tmp_path / safe
    path.touch()
    assert path.resolve().parent == tmp_path
    assert not safe.startswith(".")


@given(st.text())
def test_every_name_becomes_one_that_stays(name: str) -> None:
    safe = safe_name(name)
    assert 0 < len(safe) <= LONGEST_NAME + len("file_")
    assert "/" not in safe
    assert "\\" not in safe
    assert safe_name(safe) == safe


@pytest.mark.parametrize(
    ("name", "taken", "free"),
    [
        ("run", set(), "run"),
        ("Run", {"run", "run_2"}, "Run_3"),
        ("run.csv", {"RUN.CSV"}, "run_2.csv"),
        ("run.csv.gz", {"run.csv.gz", "run_2.csv.gz"}, "run_3.csv.gz"),
        ("2024.05.01.mf4", {"2024.05.01.mf4"}, "2024.05.01_2.mf4"),
    ],
)
def test_a_taken_name_gets_a_number_and_keeps_its_ending(
    name: str, taken: set[str], free: str
) -> None:
    assert free_name(name, taken) == free


@pytest.mark.parametrize("ending", [".csv", ".csv.gz", ".hdf5", ".TDMS", ""])
def test_a_long_name_keeps_its_ending(ending: str) -> None:
    assert safe_name("ä" * 500 + ending) == "ä" * (LONGEST_NAME - len(ending)) + ending


def test_a_session_opens_again_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "run 1.csv").touch()
    session = Session(tmp_path / "press")
    entry = session.add(tmp_path / "run 1.csv")
    entry.maps["position_m"] = 'Weg "a" [mm]'
    entry.held_out = True
    session.settings.rig.answers["bore"] = "63 mm"
    session.save()
    again = Session(tmp_path / "press")
    assert again.settings == session.settings
    assert entry.id == "run_1"
    assert again.log_of(entry) == tmp_path / "run 1.csv"
    assert entry.dt_s is None


def test_a_file_of_the_session_is_named_relative_to_it(tmp_path: Path) -> None:
    session = Session(tmp_path / "press")
    (session.folder / "logs").mkdir()
    (session.folder / "logs" / "run.csv").touch()
    entry = session.add(session.folder / "logs" / "run.csv")
    assert entry.file == "logs/run.csv"
    assert session.add(session.folder / "logs" / "run.csv") is entry
    session.folder.rename(tmp_path / "elsewhere")
    moved = Session(tmp_path / "elsewhere")
    assert moved.log_of(moved.settings.records[0]).exists()


def test_a_removed_record_takes_its_copies_along_and_never_a_file_of_the_user(
    tmp_path: Path,
) -> None:
    mine = tmp_path / "mine.csv"
    mine.touch()
    session = Session(tmp_path / "press")
    entry = session.add(mine)
    session.look_of(entry).mkdir(parents=True)
    session.remove(entry)
    assert mine.exists()
    assert not session.look_of(entry).exists()
    assert Session(tmp_path / "press").settings.records == []


@pytest.mark.parametrize(
    "file", ["gap/x.csv", "rig.toml", "linked/x.csv", "logs/../rig.toml", "../x.csv", "logs/bag"]
)
def test_only_a_copy_that_the_session_has_made_is_deleted(file: str, tmp_path: Path) -> None:
    session = Session(tmp_path / "press")
    for name in ("gap", "logs/bag"):
        (session.folder / name).mkdir(parents=True)
    (session.folder / "linked").symlink_to(tmp_path)
    for path in (tmp_path / "x.csv", session.folder / "gap" / "x.csv", session.rig_file):
        path.touch()
    entry = Entry("x", file)
    session.settings.records.append(entry)
    session.remove(entry)
    assert session.log_of(entry).exists()


@pytest.mark.parametrize("name", ["logs", "records", "looks"])
def test_what_a_link_leads_to_is_not_deleted(name: str, tmp_path: Path) -> None:
    session = Session(tmp_path / "press")
    for file in ("x.csv", "x.parquet", "x/reading.json"):
        path = tmp_path / "mine" / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    (session.folder / name).symlink_to(tmp_path / "mine")
    entry = Entry("x", "logs/x.csv")
    session.settings.records.append(entry)
    session.remove(entry)
    left = {path.name for path in (tmp_path / "mine").rglob("*")}
    assert left == {"x.csv", "x.parquet", "x", "reading.json"}


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("version = [", "move it away"),
        ("version = 99\nrecords = 3\n", "has version 99, and this ehsid reads version 1"),
        ("version = 0\n", "has version 0"),
        ('version = "2"\n', "has version '2'"),
        ('[[records]]\nid = "../x"\nfile = "a.csv"\n', "no name of a record"),
        ('[[records]]\nid = "x"\nfile = "../../x.csv"\n', "leads out of the folder"),
        ('[[records]]\nid = "x"\nfile = "logs/../../x.csv"\n', "leads out of the folder"),
    ],
)
def test_a_file_that_is_not_of_such_a_session_is_told_and_kept(
    content: str, says: str, tmp_path: Path
) -> None:
    (tmp_path / SETTINGS).write_text(content, encoding="utf-8")
    with pytest.raises(SessionError, match=re.escape(says)):
        Session(tmp_path)
    assert (tmp_path / SETTINGS).read_text(encoding="utf-8") == content


def test_a_folder_that_cannot_be_used_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(SessionError, match="name another one"):
        Session(tmp_path / "file")


def test_what_is_not_there_or_too_much_is_refused(tmp_path: Path) -> None:
    session = Session(tmp_path / "press")
    with pytest.raises(SessionError, match="no such file"):
        session.add(tmp_path / "nothing.csv")
    for number in range(MOST_RECORDS + 1):
        (tmp_path / f"{number}.csv").touch()
    for number in range(MOST_RECORDS):
        session.add(tmp_path / f"{number}.csv")
    with pytest.raises(SessionError, match="remove one first"):
        session.add(tmp_path / f"{MOST_RECORDS}.csv")


def test_pages_hear_of_changes_until_they_close(tmp_path: Path) -> None:
    session, heard = Session(tmp_path / "press"), []
    stop = session.listen(lambda: heard.append(1))
    session.save()
    stop()
    session.save()
    assert heard == [1]


def test_results_are_made_of_records_and_rig(tmp_path: Path) -> None:
    (tmp_path / "a.csv").touch()
    session = Session(tmp_path / "press")
    entry = session.add(tmp_path / "a.csv")
    digests = [session.digest(rig=True)]
    session.rig_file.write_text("a = 1")
    digests.append(session.digest(rig=True))
    entry.held_out = True
    digests.append(session.digest(rig=True))
    assert len(set(digests)) == 3
    assert session.digest(rig=False) not in digests
