# SPDX-License-Identifier: MIT
"""`ehsid hunt` and `ehsid.hunt`, with a stand-in for the diagnosis."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from diagnosis_stand_in import Asked, DiagnosisStandIn
from made_diagnoses import bench, made_diagnosis, measured_record
from offline_pages import read
from published_schemas import check_file
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import cli
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.hunt import hunting
from ehsid.harness.records import read_record, write_record
from ehsid.harness.rigs import write_rig

pytestmark = pytest.mark.usefixtures("blank_pictures", "no_plots")

AXIS = """
class Axis:
    inputs = ("command_v",)
    outputs = ("position_m",)

    def reset(self):
        self.y = 0.15
        return [self.y]

    def step(self, dt, command_v):
        self.y += dt * 0.03 * command_v
        return [self.y]
"""


class InsufficientThenFound(DiagnosisStandIn):
    """Asks for a look at the machine, and then names a cause."""

    def __init__(self) -> None:
        self.asked: list[Asked] = []

    def answer(self, asked: Asked) -> Diagnosis:
        self.asked.append(asked)
        enough = any(name.startswith("experiment") for name in asked.fitted)
        return made_diagnosis("effects" if enough else "insufficient_data")


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> InsufficientThenFound:
    monkeypatch.chdir(tmp_path)
    stand_in = InsufficientThenFound()
    monkeypatch.setattr(hunting, "diagnose", stand_in)
    write_rig(bench(), Path("rig.toml"))
    Path("axis.py").write_text(AXIS)
    write_record(measured_record("run1", 1, seconds=1.0, dt_s=5e-3), Path("run1.csv"))
    return stand_in


def run(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(cli, ["hunt", "--rig", "rig.toml", "--out", "hunt", *words])
    return done.exit_code, " ".join(done.output.split())


def test_a_hunt_writes_its_page_its_records_and_the_last_diagnosis(
    asked: InsufficientThenFound,
) -> None:
    limits = ("--max-speed", "100 mm/s", "--travel", "20 mm", "28 cm", "--max-command", "6")
    code, said = run("run1.csv", "--machine", "axis.py:Axis", *limits)
    assert code == 0, said
    assert "One cause is left after 1 experiment." in said
    check_file(Path("hunt/hunt.json"))
    told = json.loads(Path("hunt/hunt.json").read_text())
    assert told["limits"] == {
        "position_m": [0.02, 0.28],
        "command_v": 6.0,
        "speed_m_s": 0.1,
        "pressure_pa": 1.8e7,
    }
    (experiment,) = told["steps"][1]["experiments"]
    assert experiment["speed_m_s"] <= 0.1
    assert experiment["command_v"] <= 6.0
    record = read_record(Path("hunt/experiment1.csv"))
    assert record.dt_s == pytest.approx(5e-3)
    assert np.abs(record.column("command_v")).max() <= 6.0
    assert Path("hunt/diagnosis/report.html").is_file()
    page = Path("hunt/hunt.html").read_text(encoding="utf-8")
    assert "20 to 280" in page
    assert not [link for link in read(page).found if "://" in link]
    assert asked.asked[0].options.limits is not None


def test_a_rig_file_plays_the_machine_and_json_is_printed(asked: InsufficientThenFound) -> None:
    done = CliRunner().invoke(
        cli, ["hunt", "--rig", "rig.toml", "--machine", "rig.toml", "--out", "hunt", "--json"]
    )
    assert done.exit_code == 0
    told = json.loads(done.stdout)
    assert (told["machine"], told["ending"], len(told["steps"])) == ("bench", "cause", 1)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--machine", "nowhere.toml"), "nowhere.toml"),
        (("--machine", "axis.py:Crane"), "axis.py:Crane: nothing in"),
        (("--machine", "axis.py:Axis", "--budget", "0"), "--budget 0: expected a whole number"),
        (("--machine", "rig.toml", "--max-speed", "fast"), "--max-speed 'fast': expected a number"),
        (("--machine", "rig.toml", "--max-speed", "-1 m/s"), "--max-speed '-1 m/s': expected a"),
        (
            ("--machine", "rig.toml", "--travel", "280 mm", "20 mm"),
            "--travel '280 mm' '20 mm': expected the smaller position first",
        ),
    ],
)
def test_what_cannot_be_hunted_is_said(
    asked: InsufficientThenFound, words: tuple[str, ...], says: str
) -> None:
    code, said = run(*words)
    assert code == 2
    assert says in said
    assert not Path("hunt/hunt.html").exists()


def test_from_python_the_machine_is_an_object(asked: InsufficientThenFound, tmp_path: Path) -> None:
    space: dict[str, type] = {}
    exec(AXIS, space)
    found = ehsid.hunt(space["Axis"](), "rig.toml", "run1.csv", progress=False)
    assert (found.ending, len(found.records)) == ("cause", 2)
    assert "One cause is left after 1 experiment." in repr(found)
    assert found.diagnosis.verdict == "effects"
    assert len(found.plot().axes) == 2
    assert (found.save(tmp_path / "saved") / "hunt.html").is_file()
    with pytest.raises(ValueError, match="budget=0: expected at least one experiment"):
        ehsid.hunt(space["Axis"](), "rig.toml", budget=0)
