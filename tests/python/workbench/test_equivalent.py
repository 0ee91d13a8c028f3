# SPDX-License-Identifier: MIT
"""The command and the Python that a step shows do what the step does."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from app_sessions import ANSWERS, entry_of, german_log, read_session
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.rigs.questions import answered, rig_file_text
from ehsid.workbench.equivalent import commands, python, shown_commands
from ehsid.workbench.jobs import check_task
from ehsid.workbench.session import Session

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blank_pictures")]

SIMPLE = ("map", "rig", "check")


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    top = tmp_path_factory.mktemp("equivalent")
    log = german_log(top / "run of 'Monday'.csv")
    session = read_session(top / "press 7", log, german_log(top / "second.csv", 4.0, 1.0))
    entry_of(session).maps["position_m"] = "Weg [mm]"
    entry_of(session, 1).held_out = True
    rig = session.settings.rig
    rig.answers |= ANSWERS | {"oil": " "}
    rig.hoses = rig.drop_over_both = True
    entries = answered("ehs", rig.answers, hoses=True, drop_over_both=True)
    session.rig_file.write_text(rig_file_text(session.name, "ehs", entries), encoding="utf-8")
    session.save()
    return session


def results(folder: Path) -> dict[str, bytes]:
    """Return all records, the rig and the results of the check by their names."""
    found = [
        *folder.glob("records/*.parquet"),
        *folder.glob("rig.toml"),
        *folder.glob("check/*.json"),
    ]
    return {path.name: path.read_bytes() for path in sorted(found) if path.name != "remarks.json"}


def test_the_commands_give_the_same_files(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_task(session.folder, report=lambda share: None)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "records").mkdir()
    for step in SIMPLE:
        for command in commands(session, step):
            words = shlex.split(command)
            assert words[0] == "ehsid"
            outcome = CliRunner().invoke(cli, words[1:])
            assert outcome.exit_code == 0, outcome.output
    assert results(tmp_path) == results(session.folder)
    assert len(results(tmp_path)) == 4


@pytest.mark.thorough
def test_the_commands_may_be_given_in_the_folder_of_the_session(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(session.folder)
    for step in ("map", "check"):
        for command in commands(session, step):
            outcome = CliRunner().invoke(cli, shlex.split(command)[1:])
            assert outcome.exit_code == 0, outcome.output


def test_the_python_gives_the_same_files(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "records").mkdir()
    for step in ("load", *SIMPLE):
        exec(python(session, step), {})
    made, own = results(tmp_path), results(session.folder)
    assert len(made) == 3
    assert all(own[name] == content for name, content in made.items())
    assert "direction" in capsys.readouterr().out


def test_the_diagnosis_has_its_held_out_records_apart(session: Session) -> None:
    (command,) = commands(session, "gap")
    held_out = f"records/{entry_of(session, 1).id}.parquet"
    assert command.endswith(f"--rig rig.toml --validate {held_out} --out gap")
    code = python(session, "gap")
    compile(code, "gap", "exec")
    assert f"validate=[{held_out!r}]" in code


def test_the_folder_is_named_so_that_a_shell_finds_it(session: Session) -> None:
    first = shown_commands(session, "gap").splitlines()[0]
    assert shlex.split(first) == ["cd", str(session.folder)]


def test_a_rig_that_was_given_as_a_file_has_no_command(tmp_path: Path) -> None:
    assert commands(Session(tmp_path), "rig") == []
    assert "ehsid.Rig.read('rig.toml')" in python(Session(tmp_path), "rig")
