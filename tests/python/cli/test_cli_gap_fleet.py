# SPDX-License-Identifier: MIT
"""A folder of machines, with a stand-in for the diagnosis."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from check_runs import StandIn
from diagnosis_stand_in import Asked
from made_diagnoses import bench, measured_record
from offline_pages import read as read_page
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.cli.gap_fleet import read_machine
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.records import Hints, write_record
from ehsid.harness.rigs import write_rig

OF_A_MACHINE = {
    ".ehsid",
    "diagnosis.json",
    "inputs.json",
    "report.html",
    "rig.augmented.toml",
    "simulation.csv",
}
pytestmark = pytest.mark.usefixtures("blank_pictures", "no_plots")

# Folder, and the verdict that the stand-in gives for its rig.
MACHINES = {"press1": "effects", "press2": "effects", "saw": "no_gap", "lift": "ambiguous"}


@pytest.fixture(autouse=True)
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", StandIn(), raising=False)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Four machines with two records to fit and one held out."""
    monkeypatch.chdir(tmp_path)
    for seed, (name, verdict) in enumerate(MACHINES.items()):
        add_machine(tmp_path / "fleet" / name, f"{verdict}-{name}", seed)
    return tmp_path


def add_machine(folder: Path, rig: str, seed: int) -> None:
    folder.mkdir(parents=True)
    write_rig(replace(bench(), name=rig), folder / "rig.toml")
    for i, name in enumerate(("monday.csv", "tuesday.parquet", "Validate_wednesday.csv")):
        write_record(
            measured_record("record", 10 * seed + i, seconds=1.0, dt_s=5e-3), folder / name
        )


def run(*arguments: str, workers: str | None = "1") -> Any:
    tail = () if workers is None else ("--workers", workers)
    return CliRunner().invoke(cli, ["gap-fleet", *arguments, *tail])


def words(text: str) -> str:
    return " ".join(text.split())


def seen(out: Path, name: str) -> dict[str, Any]:
    plain = json.loads((out / name / "diagnosis.json").read_text(encoding="utf-8"))
    found: dict[str, Any] = plain["provenance"]
    return found


@pytest.mark.slow
def test_all_machines_are_diagnosed_and_ranked(here: Path) -> None:
    outcome = run("fleet", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    out = here / "out"
    for name, verdict in MACHINES.items():
        more = {"next_experiment.csv"} if verdict == "ambiguous" else set()
        assert {path.name for path in (out / name).iterdir()} == OF_A_MACHINE | more
        settings = seen(out, name)["settings"]
        assert settings["rig"] == f"{verdict}-{name}"
        assert settings["fitted"] == ["monday", "tuesday"]
        assert settings["held_out"] == ["Validate_wednesday"]
        assert settings["workers"] == 1
        assert [one["file"] for one in seen(out, name)["records"]] == [
            f"{name}/monday.csv",
            f"{name}/tuesday.parquet",
            f"{name}/Validate_wednesday.csv",
        ]
        assert f"{name}: {verdict}" in outcome.stderr
    fleet = json.loads((out / "fleet.json").read_text(encoding="utf-8"))
    assert fleet["schema_version"] == 1
    gaps = [one["structural"] for one in fleet["ranked"]]
    assert gaps == sorted(gaps, reverse=True)
    assert {one["name"] for one in fleet["ranked"]} == set(MACHINES)
    coulomb = next(one for one in fleet["shared"] if one["id"] == "coulomb_friction")
    assert sorted(coulomb["named"]) == ["lift", "press1", "press2"]
    stribeck = next(one for one in fleet["shared"] if one["id"] == "stribeck_friction")
    assert (stribeck["named"], stribeck["rival"]) == ([], ["lift"])
    assert not fleet["failed"]
    page = (out / "fleet.html").read_text(encoding="utf-8")
    links = {to for to in read_page(page).found if not to.startswith(("#", "data:"))}
    assert links == {f"{name}/report.html" for name in MACHINES}
    assert all((out / link).is_file() for link in links)
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page
    assert "Coulomb friction in 3 of 4" in words(outcome.stdout)


@pytest.mark.slow
def test_what_is_done_is_not_done_again_until_a_file_changes(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("fleet", "--out", "out").exit_code == 0
    before = {name: seen(here / "out", name)["seconds"] for name in MACHINES}
    diagnosed: list[str] = []

    class Counts(StandIn):
        def answer(self, asked: Asked) -> Diagnosis:
            diagnosed.append(asked.rig.name)
            return super().answer(asked)

    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", Counts(), raising=False)
    outcome = run("fleet", "--out", "out", "--json")
    assert outcome.exit_code == 0, outcome.output
    assert diagnosed == []
    assert outcome.stdout == (here / "out" / "fleet.json").read_text(encoding="utf-8")

    (here / "fleet" / "saw" / "monday.csv").unlink()
    outcome = run("fleet", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    assert diagnosed == ["no_gap-saw"]
    assert "3 of 4 machines are finished; going on" in outcome.stderr
    assert seen(here / "out", "saw")["settings"]["fitted"] == ["tuesday"]
    assert {name: seen(here / "out", name)["seconds"] for name in MACHINES} == before

    # Another catalogue is another question, for all of them.
    outcome = run("fleet", "--out", "out", "--exclude-effect", "load_force", "load_spring")
    assert outcome.exit_code == 0, outcome.output
    assert sorted(diagnosed[1:]) == sorted(
        f"{verdict}-{name}" for name, verdict in MACHINES.items()
    )
    assert seen(here / "out", "lift")["settings"]["exclude"] == ["load_force", "load_spring"]


@pytest.mark.slow
def test_a_folder_with_an_error_is_listed_and_the_others_go_on(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fleet = here / "fleet"
    (fleet / "empty").mkdir()
    shutil.copytree(fleet / "saw", fleet / "held")
    for name in ("monday.csv", "tuesday.parquet"):
        (fleet / "held" / name).unlink()
    shutil.copytree(fleet / "saw", fleet / "twice")
    shutil.copy(fleet / "saw" / "monday.csv", fleet / "twice" / "sunday.csv")
    shutil.copytree(fleet / "saw", fleet / "typo")
    (fleet / "typo" / "rig.toml").write_text('name = "typo"\nplant = "ehs"\n')
    shutil.copytree(fleet / "saw", fleet / "memory")
    (fleet / ".git").mkdir()
    add_machine(fleet / "poor", "insufficient_data-poor", 9)
    fails = StandIn(fails=("effects-press1",))
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", fails, raising=False)

    def read(folder: Path, hints: Hints) -> Any:
        if folder.name == "memory":
            raise MemoryError("no more")
        return read_machine(folder, hints)

    monkeypatch.setattr("ehsid.harness.cli.gap_fleet.read_machine", read)
    outcome = run("fleet", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    plain = json.loads((here / "out" / "fleet.json").read_text(encoding="utf-8"))
    told = {
        "empty": "has no rig.toml",
        "held": "has no record",
        "twice": "the same data as",
        "typo": "cylinder.bore_m",
        "press1": "ArithmeticError: no root for effects-press1",
        "memory": "MemoryError: no more",
    }
    assert sorted(plain["failed"]) == sorted(told)
    page = (here / "out" / "fleet.html").read_text(encoding="utf-8")
    for name, message in told.items():
        assert message in plain["failed"][name]
        assert (here / "out" / name / "error.txt").is_file()
    assert "the same data as" in page
    assert [one["name"] for one in plain["not_judged"]] == ["poor"]
    assert "The records cannot be judged" in page
    assert {one["name"] for one in plain["ranked"]} == {"press2", "saw", "lift"}

    # Once mended it is diagnosed, and nothing else is.
    shutil.copy(fleet / "saw" / "rig.toml", fleet / "typo" / "rig.toml")
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", StandIn(), raising=False)
    outcome = run("fleet", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    plain = json.loads((here / "out" / "fleet.json").read_text(encoding="utf-8"))
    assert sorted(plain["failed"]) == ["empty", "held", "memory", "twice"]


def raw_log(path: Path, delimiter: str, column: str) -> None:
    """The record of the bench as another logger has it: other names, mm, bar, a text column."""
    record = measured_record("record", 3, seconds=1.0, dt_s=5e-3)
    columns = {
        "Zeit [s]": record.time_s,
        "Stellgröße [V]": record.column("command_v"),
        column: 1e3 * record.column("position_m"),
        "p_A [bar]": 1e-5 * record.column("pressure_a_pa"),
    }
    lines = [delimiter.join([*columns, "Bediener"])]
    for row in zip(*columns.values(), strict=True):
        lines.append(delimiter.join([*(f"{number:.9g}" for number in row), "Anna"]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.slow
def test_raw_logs_are_read_as_the_rig_files_and_the_options_say(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saw: dict[str, Any] = {}

    class Seen(StandIn):
        def answer(self, asked: Asked) -> Diagnosis:
            saw[asked.rig.name] = asked.records[0]
            return super().answer(asked)

    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", Seen(), raising=False)
    fleet = here / "logs"
    block = '\n[columns]\nposition_m = { name = "CHANNEL 1", unit = "mm" }\n'
    for name, ending, delimiter, text in (
        ("by_block", "csv", ";", block),
        ("by_name", "tsv", "\t", ""),
        ("by_option", "csv", ";", ""),
    ):
        (fleet / name).mkdir(parents=True)
        write_rig(replace(bench(), name=name), fleet / name / "rig.toml")
        with (fleet / name / "rig.toml").open("a", encoding="utf-8") as rig:
            rig.write(text)
        (fleet / name / "notes.txt").write_text("12 new seals\n", encoding="utf-8")
        column = "Stroke [mm]" if name == "by_name" else "CHANNEL 1"
        raw_log(fleet / name / f"run.{ending}", delimiter, column)

    outcome = run("logs", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    plain = json.loads((here / "out" / "fleet.json").read_text(encoding="utf-8"))
    assert list(plain["failed"]) == ["by_option"]
    assert "no column 'position_m'" in plain["failed"]["by_option"]
    assert "columns without numbers are left out: 'Bediener'" in words(outcome.stderr)
    truth = measured_record("record", 3, seconds=1.0, dt_s=5e-3)
    assert set(saw) == {"by_block", "by_name"}
    for record in saw.values():
        for name in ("command_v", "position_m", "pressure_a_pa"):
            np.testing.assert_allclose(record.column(name), truth.column(name), rtol=1e-8)

    # An option holds for all machines, and with another option the results are made anew.
    shutil.rmtree(fleet / "by_name")
    saw.clear()
    option = ("--map", "position_m=CHANNEL 1 [cm]")
    for expected in ({"by_block", "by_option"}, set[str]()):
        outcome = run("logs", "--out", "out", *option)
        assert outcome.exit_code == 0, outcome.output
        assert set(saw) == expected
        for record in saw.values():
            np.testing.assert_allclose(
                record.column("position_m"), 10.0 * truth.column("position_m"), rtol=1e-8
            )
        saw.clear()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("most", "workers"),
    [
        (0, "1"),
        (0, "2"),
        (64_000_000, "1"),
        pytest.param(64_000_000, "2", marks=pytest.mark.thorough),
    ],
)
def test_machines_are_the_same_whether_they_are_read_here_or_there(
    most: int, workers: str, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ehsid.harness.fleet.MOST_SENT", most)
    fleet = here / "fleet"
    for name in ("press1", "press2"):
        shutil.rmtree(fleet / name)
    shutil.copytree(fleet / "saw", fleet / "broken")
    (fleet / "broken" / "rig.toml").write_text("[[[")
    raw_log(fleet / "lift" / "thursday.csv", ";", "Stroke [mm]")
    outcome = run("fleet", "--out", "out", workers=workers)
    assert outcome.exit_code == 0, outcome.output
    plain = json.loads((here / "out" / "fleet.json").read_text(encoding="utf-8"))
    assert {one["name"] for one in plain["ranked"]} == {"saw", "lift"}
    assert plain["failed"]["broken"].startswith("fleet/broken/rig.toml: line 1, column 3: not TOML")
    error = (here / "out" / "broken" / "error.txt").read_text(encoding="utf-8")
    assert error.startswith("fleet/broken/rig.toml: line 1, column 3: not TOML")
    assert "thursday: read as text" in outcome.stderr
    assert [one["file"] for one in seen(here / "out", "lift")["records"]] == [
        f"lift/{name}"
        for name in ("monday.csv", "thursday.csv", "tuesday.parquet", "Validate_wednesday.csv")
    ]


def test_nothing_diagnosed_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "fleet" / "empty").mkdir(parents=True)
    outcome = run(str(tmp_path / "fleet"), "--out", str(tmp_path / "out"))
    assert outcome.exit_code == 2
    assert "nothing could be diagnosed" in words(outcome.stderr)
    assert "has no rig.toml" in words(outcome.stderr)
    assert "has no rig.toml" in (tmp_path / "out" / "fleet.html").read_text(encoding="utf-8")


@pytest.mark.thorough
def test_a_cluster_gives_the_same_files(here: Path, dask_cluster: str) -> None:
    outcome = run("fleet", "--out", "out", "--dask", dask_cluster, workers=None)
    assert outcome.exit_code == 0, outcome.output
    for name in MACHINES:
        assert {path.name for path in (here / "out" / name).iterdir()} >= OF_A_MACHINE


@pytest.mark.slow
def test_a_machine_whose_process_is_killed_does_not_end_the_others(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", StandIn(kills=("effects-press2",)))
    for name in ("lift", "saw"):
        shutil.rmtree(here / "fleet" / name)
    outcome = run("fleet", "--out", "out", workers="2")
    assert outcome.exit_code == 0, outcome.output
    error = (here / "out" / "press2" / "error.txt").read_text(encoding="utf-8")
    assert "its process was killed" in error
    assert (here / "out" / "press1" / "diagnosis.json").is_file()
    plain = json.loads((here / "out" / "fleet.json").read_text(encoding="utf-8"))
    assert list(plain["failed"]) == ["press2"]


@pytest.mark.slow
def test_a_verdict_of_a_machine_that_must_not_be_ends_with_3(here: Path) -> None:
    (here / "fleet" / "broken").mkdir()
    for fail_on, machines in (
        ("parameters", []),
        ("ambiguous", ["lift: ambiguous"]),
        ("insufficient_data,no_gap", ["saw: no_gap"]),
        ("any", ["broken: could not be diagnosed", "lift: ambiguous", "press1: effects"]),
    ):
        outcome = run("fleet", "--out", "out", "--fail-on", fail_on, "--quiet")
        assert outcome.exit_code == (3 if machines else 0), outcome.output
        assert ("because --fail-on names the results of" in outcome.stderr) == bool(machines)
        assert all(machine in outcome.stderr for machine in machines)
        assert (here / "out" / "fleet.json").is_file()
    again = run("fleet", "--out", "out", "--verbose")
    assert "saw: its files have not changed; its diagnosis is kept" in again.stderr
