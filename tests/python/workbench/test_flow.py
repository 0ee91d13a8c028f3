# SPDX-License-Identifier: MIT
"""A step opens when the one before holds, and says what it lacks."""

from __future__ import annotations

from pathlib import Path

import pytest
from app_sessions import BENCH, entry_of, german_log, read_session

from ehsid.workbench.flow import STEPS, next_step, step_states
from ehsid.workbench.reading import read_log
from ehsid.workbench.session import Session

KEYS = [step.key for step in STEPS]


def open_steps(session: Session) -> list[str]:
    return [key for key, state in step_states(session).items() if state.open]


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return read_session(tmp_path / "press", german_log(tmp_path / "run.csv", 1.0))


def test_an_empty_session_waits_for_a_record(tmp_path: Path) -> None:
    session = Session(tmp_path)
    assert open_steps(session) == ["load"]
    assert step_states(session)["map"].why == "Load comes first: there is no record yet."
    assert next_step(session) == "load"


def test_a_record_that_is_read_opens_map_and_rig(session: Session) -> None:
    assert open_steps(session) == ["load", "map", "rig"]
    assert step_states(session)["map"].done


def test_what_the_user_said_anew_has_to_be_read(session: Session) -> None:
    entry_of(session).maps["position_m"] = "Druck A [bar]"
    assert step_states(session)["map"].why == "run is not read yet."
    read_log(session, entry_of(session))
    assert "could not be read" in step_states(session)["map"].why
    assert open_steps(session) == ["load", "map"]


def test_without_command_or_with_nothing_to_fit_the_rig_stays_closed(
    tmp_path: Path, session: Session
) -> None:
    entry_of(session).held_out = True
    assert "at least one has to be fitted" in step_states(session)["map"].why
    log = tmp_path / "two.csv"
    log.write_text("time_s,position_m\n" + "\n".join(f"{i / 1000},{i % 7}" for i in range(50)))
    other = read_session(tmp_path / "other", log)
    assert step_states(other)["map"].why == "the command of two is not known."


def test_a_rig_opens_the_check_and_a_wrong_one_does_not(session: Session) -> None:
    session.rig_file.write_text("plant = 'ehs'\n")
    assert "check" not in open_steps(session)
    session.rig_file.write_bytes(BENCH.read_bytes())
    assert open_steps(session)[-1] == "check"


def test_results_hold_until_records_or_rig_change(session: Session) -> None:
    session.rig_file.write_bytes(BENCH.read_bytes())
    for key, file in (("check", "rig_check.json"), ("gap", "diagnosis.json")):
        (session.folder / key).mkdir()
        (session.folder / key / file).write_text("{}")
        session.settings.made_of[key] = session.digest(rig=True)
    assert open_steps(session) == KEYS
    assert step_states(session)["gap"].done
    session.rig_file.write_text(BENCH.read_text() + "\n# changed\n")
    assert step_states(session)["check"].why == "records or rig have changed since; run it again."
    assert next_step(session) == "check"
