# SPDX-License-Identifier: MIT
"""`ehsid start`: the commands that it runs, with a stand-in for the diagnosis."""

from __future__ import annotations

import builtins
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from diagnosis_stand_in import FakeDiagnose
from made_diagnoses import made_diagnosis, measured_record
from typer.testing import CliRunner

from ehsid.harness import diagnosis
from ehsid.harness.cli import cli, start
from ehsid.harness.records import write_record
from ehsid.harness.rigs import read_rig

pytestmark = pytest.mark.usefixtures("blank_pictures", "no_plots")

PLATE = (
    *("--bore", "63 mm", "--rod", "35 mm", "--stroke", "300 mm"),
    *("--supply", "120 bar", "--rated-flow", "38 l/min"),
)


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeDiagnose:
    monkeypatch.chdir(tmp_path)
    stand_in = FakeDiagnose(made_diagnosis("effects"))
    monkeypatch.setattr(diagnosis, "diagnose", stand_in)
    for place in (1, 2):
        record = measured_record("record", place, seconds=4.0, dt_s=2e-3)
        write_record(record, Path(f"run{place}.csv"))
    return stand_in


def run(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(cli, ["start", *words])
    return done.exit_code, done.output


def test_logs_and_a_name_plate_become_a_report(fake: FakeDiagnose) -> None:
    code, said = run("run1.csv", "run2.csv", *PLATE, "--out", "press")
    assert code == 0, said
    assert Path("press/diagnosis/report.html").is_file()
    assert read_rig(Path("press/rig.toml")).values["cylinder.bore_m"] == 0.063
    assert fake.asked.fitted == ["run1", "run2"]
    commands = [line.strip() for line in said.splitlines() if line.startswith("  ehsid ")]
    assert commands == [
        "ehsid import run1.csv --out press/run1.npz",
        "ehsid import run2.csv --out press/run2.npz",
        "ehsid rig new --bore '63 mm' --rod '35 mm' --stroke '300 mm' --supply '120 bar' "
        "--rated-flow '38 l/min' --name press --out press/rig.toml",
        "ehsid rig check press/rig.toml press/run1.npz press/run2.npz",
        "ehsid gap press/run1.npz press/run2.npz --rig press/rig.toml --out press/diagnosis",
    ]


def test_a_corrected_rig_file_is_taken_as_it_is(fake: FakeDiagnose) -> None:
    assert run("run1.csv", *PLATE)[0] == 0
    rig = Path("start/rig.toml")
    rig.write_text(rig.read_text().replace("bore_m = 0.063", "bore_m = 0.064"))
    code, said = run("run1.csv")
    assert code == 0, said
    assert fake.asked.rig.values["cylinder.bore_m"] == 0.064
    assert "ehsid rig new" not in said
    assert "not used" not in said


def test_a_name_plate_beside_a_rig_file_is_told_to_be_unused(fake: FakeDiagnose) -> None:
    assert run("run1.csv", *PLATE)[0] == 0
    code, said = run("run1.csv", "--bore", "80 mm", "--supply", "210 bar")
    assert code == 0, said
    assert "not used: --bore, --supply. Edit this file" in " ".join(said.split())
    assert fake.asked.rig.values["cylinder.bore_m"] == 0.063


def test_on_a_terminal_the_five_values_are_asked_for(
    fake: FakeDiagnose, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers: Iterator[str] = iter(["wide", "63 mm", "35 mm", "300 mm", "120 bar", "38 l/min"])
    opened: list[str] = []
    monkeypatch.setattr(start, "_on_a_terminal", lambda: True)
    monkeypatch.setattr(builtins, "input", lambda: next(answers))
    monkeypatch.setattr(start.typer, "launch", opened.append)
    code, said = run("run1.csv")
    assert code == 0, said
    assert "expected a number and its unit" in said  # of the answer "wide"
    assert not list(answers)
    assert opened == [(Path("start/diagnosis/report.html").absolute()).as_uri()]


def log_of(name: str, unit: str) -> None:
    """Write a log whose command has this unit, and a name of its own."""
    record = measured_record("record", 1, seconds=4.0, dt_s=2e-3)
    columns = {"Zeit [s]": record.time_s, f"{name} [{unit}]": 10.0 * record.columns["command_v"]}
    columns["Weg [mm]"] = 1e3 * record.columns["position_m"]
    rows = np.column_stack(list(columns.values()))
    np.savetxt("log.csv", rows, delimiter=";", header=";".join(columns), comments="", fmt="%.5f")


def test_a_command_in_per_cent_has_a_rated_command_of_100(fake: FakeDiagnose) -> None:
    log_of("Stellgröße", "%")
    code, said = run("log.csv", *PLATE)
    assert code == 0, said
    assert fake.asked.rig.values["valve.rated_command_v"] == 100.0
    assert "--rated-command '100 %'" in said
    assert run("log.csv", *PLATE, "--rated-command", "50 %", "--out", "half")[0] == 0
    assert fake.asked.rig.values["valve.rated_command_v"] == 50.0


def test_a_command_in_ma_needs_its_rated_command(
    fake: FakeDiagnose, monkeypatch: pytest.MonkeyPatch
) -> None:
    log_of("Stellgröße", "mA")
    code, said = run("log.csv", *PLATE)
    assert code == 2
    assert "--rated-command: missing, and the command of the logs is in mA" in said
    assert not fake.calls
    answers = iter(["63 mm", "35 mm", "300 mm", "120 bar", "38 l/min", "20 mA"])
    monkeypatch.setattr(start, "_on_a_terminal", lambda: True)
    monkeypatch.setattr(builtins, "input", lambda: next(answers))
    assert run("log.csv", "--no-open")[0] == 0
    assert fake.asked.rig.values["valve.rated_command_v"] == 20.0


def test_a_log_without_a_command_is_refused_before_the_questions(
    fake: FakeDiagnose, monkeypatch: pytest.MonkeyPatch
) -> None:
    log_of("Ventilstellung", "%")
    monkeypatch.setattr(start, "_on_a_terminal", lambda: True)  # no answer is ready
    code, said = run("log.csv")
    assert code == 2
    assert "there is no column 'command_v'" in said
    option = "command_v=Ventilstellung [percent]"
    assert f"--map '{option}'" in said
    assert not Path("start").exists()
    code, said = run("log.csv", *PLATE, "--map", option, "--no-open")
    assert code == 0, said


@pytest.mark.parametrize(
    ("option", "size", "words"),
    [("--bore", "wide", "--bore 'wide': expected a number"), ("--rod", "70 mm", "rod")],
)
def test_a_wrong_size_ends_it_before_anything_is_written(
    fake: FakeDiagnose, option: str, size: str, words: str
) -> None:
    code, said = run("run1.csv", *PLATE, option, size)
    assert code == 2
    assert words in " ".join(said.split())
    assert not Path("start").exists()
    assert not fake.calls
