# SPDX-License-Identifier: MIT
"""The rig that was found becomes that of the machine or of a new one; the old one is kept."""

from __future__ import annotations

from pathlib import Path

import pytest
from app_diagnosed import diagnosed_session
from app_sessions import BENCH

from ehsid.harness.rigs import RigError
from ehsid.workbench.adoption import FOUND, as_new_machine, use_as_rig
from ehsid.workbench.flow import step_states
from ehsid.workbench.session import Session, SessionError
from ehsid.workbench.workbench import Workbench

pytestmark = pytest.mark.slow


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return diagnosed_session(tmp_path / "machines" / "press")


def test_the_found_rig_replaces_the_one_before_which_is_kept(session: Session) -> None:
    session.settings.rig.answers["bore"] = "63 mm"
    found = (session.folder / FOUND).read_bytes()
    assert use_as_rig(session) == "rig.before.toml"
    assert session.rig_file.read_bytes() == found
    assert (session.folder / "rig.before.toml").read_bytes() == BENCH.read_bytes()
    assert not session.settings.rig.answers
    assert not step_states(session)["gap"].open
    assert use_as_rig(session) == "rig.before_2.toml"
    assert (session.folder / "rig.before.toml").read_bytes() == BENCH.read_bytes()


def test_a_new_machine_has_the_rig_and_no_records(session: Session) -> None:
    workbench = Workbench(session.folder.parent)
    made = as_new_machine(workbench, session)
    assert made.name == "press_found"
    assert made.rig_file.read_bytes() == (session.folder / FOUND).read_bytes()
    assert made.settings.records == []
    assert session.rig_file.read_bytes() == BENCH.read_bytes()
    assert as_new_machine(workbench, session).name == "press_found_2"


def test_without_a_rig_or_with_a_damaged_one_nothing_changes(session: Session) -> None:
    (session.folder / FOUND).write_text("plant = 'none'")
    with pytest.raises(RigError):
        use_as_rig(session)
    (session.folder / FOUND).unlink()
    with pytest.raises(SessionError, match="run the diagnosis again"):
        use_as_rig(session)
    assert session.rig_file.read_bytes() == BENCH.read_bytes()
    assert not list(session.folder.glob("rig.before*"))
