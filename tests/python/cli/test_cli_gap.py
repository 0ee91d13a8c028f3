# SPDX-License-Identifier: MIT
import json
import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diagnosis_stand_in import FakeDiagnose
from interrupts import interruptible
from made_diagnoses import VERDICTS, bench, made_diagnosis, measured_record
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.cli.console import repeated
from ehsid.harness.diagnosis.data.gate import how_read
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.schema import Remark
from ehsid.harness.records import write_record
from ehsid.harness.rigs import write_rig


@pytest.fixture
def diagnose(monkeypatch: pytest.MonkeyPatch) -> FakeDiagnose:
    fake = FakeDiagnose(made_diagnosis("effects"))
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", fake, raising=False)
    return fake


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a rig and three records, and the working directory in it."""
    monkeypatch.chdir(tmp_path)
    write_rig(bench(), tmp_path / "rig.toml")
    for seed, name in enumerate(("one", "two", "three")):
        record = measured_record(name, seed, seconds=1.0, dt_s=5e-3)
        write_record(record, tmp_path / f"{name}.csv")
    return tmp_path


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli, ["gap", *arguments])


@pytest.mark.usefixtures("no_plots")
def test_what_is_asked_reaches_the_diagnosis(diagnose: FakeDiagnose, here: Path) -> None:
    options = ["--rig", "rig.toml", "--validate", "two.csv", "three.csv", "--out", "out"]
    options += ["--exclude-effect", "coulomb_friction", "load_force", "--workers", "2"]
    outcome = run("one.csv", *options)
    assert outcome.exit_code == 0, outcome.output
    assert diagnose.asked.fitted == ["one"]
    assert diagnose.asked.held_out == ["two", "three"]
    assert diagnose.asked.options == DiagnosisOptions(("coulomb_friction", "load_force"))
    assert diagnose.asked.workers == 2
    assert diagnose.asked.progress is not None
    assert diagnose.asked.begun is not None
    assert dict(diagnose.asked.rig.values) == dict(bench().values)
    assert set(diagnose.asked.records[0].columns) == {
        "command_v",
        "position_m",
        "pressure_a_pa",
        "pressure_b_pa",
    }
    provenance = json.loads((here / "out" / "diagnosis.json").read_text())["provenance"]
    assert [(r["file"], r["role"]) for r in provenance["records"]] == [
        ("one.csv", "fit"),
        ("two.csv", "held out"),
        ("three.csv", "held out"),
    ]
    assert all(len(record["sha256"]) == 64 for record in provenance["records"])


@pytest.mark.parametrize(
    ("given", "made"),
    [
        ("a b --rig r", "a b --rig r"),
        ("a --validate b c --rig r", "a --validate b --validate c --rig r"),
        ("a --validate b --validate c d", "a --validate b --validate c --validate d"),
        ("a --validate=b c --json", "a --validate=b --validate c --json"),
        ("--exclude-effect x y --rig r a", "--exclude-effect x --exclude-effect y --rig r a"),
        ("--validate b -- -a c", "--validate b -- -a c"),
        ("a --validate", "a --validate"),
    ],
)
def test_options_take_all_values_up_to_the_next(given: str, made: str) -> None:
    assert repeated(given.split()) == made.split()


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures", "no_plots")
@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_is_a_result(verdict: Any, diagnose: FakeDiagnose, here: Path) -> None:
    diagnose.diagnosis = made_diagnosis(verdict)
    outcome = run("one.csv", "--rig", "rig.toml", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    words = " ".join(outcome.stdout.split())
    assert " ".join(diagnose.diagnosis.sentence.split()) in words
    assert str(Path("out") / "report.html") in words
    for one in diagnose.diagnosis.cannot_judge:
        assert one.why in words
    assert ("next_experiment.csv" in words) == (verdict == "ambiguous")
    # The interval of the force; the law of the cause outside of the catalogue has its size, too.
    assert ("396" in words) == bool(diagnose.diagnosis.effects)
    assert ("missing law" in words) == bool(diagnose.diagnosis.missing_laws)
    assert (here / "out" / "report.html").is_file()


@pytest.mark.slow
@pytest.mark.usefixtures("no_plots")
@pytest.mark.parametrize(
    ("fail_on", "code"), [("effects", 3), ("any", 3), ("no_gap", 0), ("efects", 2)]
)
def test_a_verdict_that_must_not_be_ends_with_3_and_all_results(
    fail_on: str, code: int, diagnose: FakeDiagnose, here: Path
) -> None:
    diagnose.diagnosis = made_diagnosis("effects")
    outcome = run("one.csv", "--rig", "rig.toml", "--out", "out", "--fail-on", fail_on)
    assert outcome.exit_code == code, outcome.output
    assert ("--fail-on" in outcome.stderr) == (code > 0)
    assert (here / "out" / "diagnosis.json").is_file() == (code != 2)


@pytest.mark.slow
@pytest.mark.usefixtures("no_plots")
def test_how_a_log_was_read_is_told_once(diagnose: FakeDiagnose, here: Path) -> None:
    log = (here / "one.csv").read_text().replace("position_m", "Stroke [m]", 1)
    (here / "log.csv").write_text(log)
    options = ("log.csv", "--rig", "rig.toml", "--out", "out")
    assert run(*options).exit_code == 0
    remarks = tuple(how_read(diagnose.asked.records[0]))
    assert remarks
    other = Remark("log", "a remark on the data")
    diagnose.diagnosis = replace(made_diagnosis("effects"), remarks=(*remarks, other))
    outcome = run(*options)
    assert "Stroke [m]" in outcome.stderr
    assert "Stroke [m]" not in outcome.stdout
    assert "note: log: a remark on the data" in outcome.stdout
    assert "Stroke [m]" in run(*options, "--quiet").stdout


@pytest.mark.usefixtures("no_plots")
def test_json_on_the_terminal_is_the_file(diagnose: FakeDiagnose, here: Path) -> None:
    outcome = run("one.csv", "--rig", "rig.toml", "--out", "deep/down", "--json")
    assert outcome.exit_code == 0, outcome.output
    assert diagnose.asked.validate == []
    file = here / "deep" / "down" / "diagnosis.json"
    assert outcome.stdout == file.read_text(encoding="utf-8")


@pytest.mark.usefixtures("no_plots")
def test_columns_that_are_no_numbers_are_left_alone(diagnose: FakeDiagnose, here: Path) -> None:
    lines = (here / "one.csv").read_text().splitlines()
    noted = [f"{lines[0]},remark", *(f"{line},fine" for line in lines[1:])]
    (here / "noted.csv").write_text("\n".join(noted))
    outcome = run("noted.csv", "--rig", "rig.toml", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    assert "remark" not in diagnose.asked.records[0].columns


@pytest.mark.usefixtures("no_plots")
def test_records_of_one_name_are_told_apart(diagnose: FakeDiagnose, here: Path) -> None:
    for day, name in (("monday", "one"), ("tuesday", "two")):
        (here / day).mkdir()
        (here / f"{name}.csv").rename(here / day / "log.csv")
    options = ["--rig", "rig.toml", "--out", "out", "--validate", "tuesday/log.csv"]
    outcome = run("monday/log.csv", "three.csv", *options)
    assert outcome.exit_code == 0, outcome.output
    assert diagnose.asked.fitted == ["monday_log", "three"]
    assert diagnose.asked.held_out == ["tuesday_log"]


# Eight tasks of a minute in processes of their own, as a diagnosis runs them.
LONG_WORK = """
import sys, time
import ehsid.harness.diagnosis
from ehsid.harness.base.parallel import run_tasks
from functools import partial

def diagnose(*_, progress, **__):
    print("started", file=sys.stderr, flush=True)
    run_tasks([partial(time.sleep, 60.0)] * 8, progress)

ehsid.harness.diagnosis.diagnose = diagnose
from ehsid.harness.cli import main
sys.argv = ["ehsid", "gap", "one.csv", "--rig", "rig.toml", "--out", "out"]
main()
"""


def alive(group: int) -> bool:
    """Is any process of the group left?"""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals to a group of processes")
def test_ctrl_c_ends_all_and_leaves_nothing(here: Path) -> None:
    with interruptible([sys.executable, "-c", LONG_WORK]) as work:
        assert work.stderr is not None
        while "started" not in (line := work.stderr.readline()):
            assert line, "the command ended before it began"
        time.sleep(1.0)  # its workers are running now
        # A terminal sends it to the whole group.
        os.killpg(work.pid, signal.SIGINT)
        out, err = work.communicate(timeout=60)
        assert work.returncode == 130
        assert "Traceback" not in out + err
        assert sorted(path.name for path in here.iterdir()) == [
            "one.csv",
            "rig.toml",
            "three.csv",
            "two.csv",
        ]
        # No worker is left behind; they end a moment later than what started them.
        deadline = time.monotonic() + 60.0
        while alive(work.pid) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not alive(work.pid)
