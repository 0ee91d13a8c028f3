# SPDX-License-Identifier: MIT
"""How a log is read and kept; a log that is no record can be drawn all the same."""

from __future__ import annotations

from pathlib import Path

import pytest
from app_sessions import HEAD, entry_of, german_log, read_session

from ehsid.harness.records import read_record
from ehsid.workbench.downsampling import opened
from ehsid.workbench.reading import read_alike, read_log, reading_of


def test_a_german_log_becomes_a_record_in_si_units(tmp_path: Path) -> None:
    session = read_session(tmp_path / "press", german_log(tmp_path / "run.csv", 1.0))
    reading = reading_of(session, entry_of(session))
    assert reading is not None
    assert reading.problem == ""
    assert [column.name for column in reading.columns] == HEAD.split(";")
    assert {row[1]: row[0] for row in reading.taken}["position_m"] == "Weg [mm]"
    assert (reading.samples, reading.dt_s) == (1000, pytest.approx(1e-3))
    record = read_record(session.record_of(entry_of(session)))
    assert list(record.columns) == reading.channels
    drawn = opened(session.look_of(entry_of(session)), "raw_2")
    assert 1e3 * record.column("position_m")[7] == pytest.approx(drawn.values[7])


def test_runs_of_one_logger_are_read_alike(tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("time_s,a\n0,1\n0.001,2\n")
    logs = [german_log(tmp_path / f"run{i}.csv", 0.1) for i in range(4)]
    session = read_session(tmp_path / "press", *logs, other)
    entries = session.settings.records
    entries[3].maps["position_m"] = "Druck A [mm]"
    assert read_alike(session, entries[0]) == entries[1:3]
    assert read_alike(session, entries[3]) == []
    assert read_alike(session, entries[4]) == []


def test_a_log_without_any_signal_known_is_drawn(tmp_path: Path) -> None:
    log = tmp_path / "odd.csv"
    log.write_text("time_s,a\n0,1\n0.001,NaN\n0.0005,3\n-7,4\n")
    session = read_session(tmp_path / "press", log)
    reading = reading_of(session, entry_of(session))
    assert reading is not None
    assert reading.problem
    assert not session.record_of(entry_of(session)).exists()
    assert opened(session.look_of(entry_of(session)), reading.columns[1].key).values[3] == 4.0


def test_a_file_that_is_no_log_says_so(tmp_path: Path) -> None:
    log = tmp_path / "picture.mat"
    log.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(200))
    session = read_session(tmp_path / "press", log)
    reading = reading_of(session, entry_of(session))
    assert reading is not None
    assert (reading.kind, reading.columns) == ("", [])
    assert "To fix it" in reading.problem


def test_a_wrong_unit_removes_the_record_of_before(tmp_path: Path) -> None:
    session = read_session(tmp_path / "press", german_log(tmp_path / "run.csv", 0.1))
    entry = entry_of(session)
    assert session.record_of(entry).exists()
    entry.maps["position_m"] = "Weg [bar]"
    assert "is not a unit of 'position_m'" in read_log(session, entry).problem
    assert not session.record_of(entry).exists()


def test_a_damaged_note_counts_as_unread(tmp_path: Path) -> None:
    session = read_session(tmp_path / "press", german_log(tmp_path / "run.csv", 0.1))
    (session.look_of(entry_of(session)) / "reading.json").write_text("{")
    assert reading_of(session, entry_of(session)) is None
