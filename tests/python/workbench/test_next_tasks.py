# SPDX-License-Identifier: MIT
"""The header is that of the command, and the archive opens again."""

from __future__ import annotations

import shlex
import zipfile
from pathlib import Path

import msgspec
import pytest
from app_diagnosed import diagnosed_session
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.workbench.equivalent import commands, python
from ehsid.workbench.flow import step_states
from ehsid.workbench.next_tasks import (
    FIRMWARE,
    MADE,
    HeaderMade,
    header_task,
    package_task,
    packed_files,
)
from ehsid.workbench.reading import read_log
from ehsid.workbench.session import Session, SessionError

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blank_pictures")]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    top = tmp_path_factory.mktemp("next")
    return diagnosed_session(top / "machines" / "press", seconds=3.0)


def silent(share: float) -> None:
    assert 0.0 <= share <= 1.0


@pytest.mark.parametrize(("c", "like_model"), [(False, False), (True, False), (False, True)])
def test_the_header_is_that_of_the_command_and_of_the_python(
    session: Session, c: bool, like_model: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    firmware = session.settings.firmware
    firmware.record, firmware.name, firmware.c = session.settings.records[0].id, "axis_7", c
    firmware.like_model = like_model
    session.settings.model.na, session.settings.model.policy = 2, "error-driven"
    session.save()
    header_task(session.folder, report=silent)
    made = msgspec.json.decode((session.folder / FIRMWARE / MADE).read_bytes(), type=HeaderMade)
    target = session.folder / FIRMWARE / made.file
    text = target.read_text(encoding="utf-8")
    assert "axis_7" in text
    assert ("rror_driven" in text or "ErrorDriven" in text) == like_model
    assert made.file.endswith(".h") == c
    assert made.told == session.settings.records[0].told()
    monkeypatch.chdir(session.folder)
    (command,) = commands(session, "next")
    outcome = CliRunner().invoke(cli, shlex.split(command)[1:])
    assert outcome.exit_code == 0, outcome.output
    assert target.read_text(encoding="utf-8") == text
    target.unlink()
    exec(python(session, "next"), {})
    assert target.read_text(encoding="utf-8") == text
    target.unlink()


def test_without_a_record_there_is_no_command_and_the_task_says_why(tmp_path: Path) -> None:
    session = Session(tmp_path)
    assert commands(session, "next") == []
    compile(python(session, "next"), "next", "exec")
    with pytest.raises(SessionError, match="choose one"):
        header_task(tmp_path, report=silent)


@pytest.mark.parametrize("name", ["logs", "gap", "gap/deeper"])
def test_a_folder_behind_a_link_is_not_packed(name: str, tmp_path: Path) -> None:
    session = Session(tmp_path / "press")
    session.save()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "secret.csv").touch()
    (session.folder / name).parent.mkdir(exist_ok=True)
    (session.folder / name).symlink_to(tmp_path / "mine")
    assert [path.name for path in packed_files(session.folder)] == ["session.toml"]


def test_the_archive_opens_as_a_session_of_its_own(session: Session, tmp_path: Path) -> None:
    (session.folder / "errors.log").write_text("x")
    (session.folder / "records" / "link.csv").symlink_to(Path(__file__))
    (session.folder / "model").mkdir(exist_ok=True)
    (session.folder / "model" / "identify.json").write_text("{}")
    shares: list[float] = []
    package_task(session.folder, report=shares.append)
    assert shares[-1] == 1.0
    with zipfile.ZipFile(session.folder / "package" / "press.zip") as archive:
        names = archive.namelist()
        archive.extractall(tmp_path)
    assert all(name.startswith("press/") for name in names)
    assert "press/model/identify.json" in names
    assert not [name for name in names if "errors.log" in name or "link" in name]
    opened = Session(tmp_path / "press")
    read_log(opened, opened.settings.records[0])
    assert step_states(opened)["next"].open
    package_task(session.folder, report=silent)
    assert not [path for path in packed_files(session.folder) if path.suffix == ".zip"]
