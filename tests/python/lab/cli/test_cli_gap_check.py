# SPDX-License-Identifier: MIT
"""The command that checks the diagnosis, with a stand-in for it."""

import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from check_runs import StandIn
from diagnosis_stand_in import Asked
from typer.testing import CliRunner

import ehsid
from ehsid.harness.base.error_words import install_line
from ehsid.harness.cli import cli
from ehsid.harness.cli.console import Console
from ehsid.harness.cli.progress import shown
from ehsid.harness.diagnosis.job import Outcome
from ehsid.harness.diagnosis.result import Diagnosis

TINY = ("--count", "3", "--seconds", "2", "--seed", "7")


@pytest.fixture(autouse=True)
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", StandIn(), raising=False)


def run(*arguments: str, workers: str | None = "1") -> Any:
    tail = () if workers is None else ("--workers", workers)
    return CliRunner().invoke(cli, ["gap-check", *arguments, *tail])


def words(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.thorough
def test_a_check_is_made_sealed_run_and_scored(tmp_path: Path) -> None:
    out = tmp_path / "check"
    outcome = run("--out", str(out), *TINY)
    assert outcome.exit_code == 0, outcome.output
    seal = json.loads((out / "seal.json").read_text(encoding="utf-8"))
    lines = outcome.stderr.splitlines()
    # The digest stands before the first case.
    told = lines.index(f"answers sealed, sha256 {seal['answers_sha256']}")
    cases = [line for line in lines[told + 1 :] if re.match(r"\d of 3, [0-9a-f]{8}: effects", line)]
    assert len(cases) == 3
    assert "left" in cases[0]
    assert "left" not in cases[2]
    assert seal["settings"]["count"] == 3
    assert seal["ehsid_version"] == ehsid.__version__
    assert len(list((out / "results").iterdir())) == 3
    assert (out / "report.html").is_file()
    assert json.loads((out / "score.json").read_text(encoding="utf-8"))["records"] == 3
    assert "report.html" in words(outcome.stdout)


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_the_same_command_goes_on_and_then_only_scores(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "check"
    assert run("--out", str(out), *TINY).exit_code == 0
    lost = sorted((out / "results").iterdir())[1]
    kept = {
        path: path.stat().st_mtime_ns
        for path in (out / "results").glob("*/diagnosis.json")
        if path.parent != lost
    }
    shutil.rmtree(lost)
    outcome = run("--out", str(out))  # settings are those of the seal
    assert outcome.exit_code == 0, outcome.output
    assert "2 of 3 cases are finished; going on" in outcome.stderr
    assert f"3 of 3, {lost.name}: effects" in outcome.stderr
    assert {path: path.stat().st_mtime_ns for path in kept} == kept

    def never(*_: Any, **__: Any) -> Diagnosis:
        raise AssertionError("nothing is left to diagnose")

    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", never, raising=False)
    outcome = run("--out", str(out), *TINY, "--json")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout == (out / "score.json").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--count", "4"], "count 3, not 4"),
        (["--seed", "8", "--count", "3"], "seed 7, not 8"),
        (
            ["--grade", "hard"],
            "grades plain+hard+confusable+slow+wide+abroad+linkage+field, not hard",
        ),
        (["--sensors", "position"], "sensors drawn, not position"),
        (["--exclude-truth"], "exclude_truth false, not true"),
    ],
)
def test_other_settings_on_the_same_folder_are_refused(
    options: list[str], told: str, made: Path
) -> None:
    before = sorted(path.name for path in made.iterdir())
    outcome = run("--out", str(made), *options)
    assert outcome.exit_code == 2
    assert told in words(outcome.stderr)
    assert "name a new folder" in words(outcome.stderr)
    assert sorted(path.name for path in made.iterdir()) == before


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from ehsid.harness.base.parallel import workers
    from ehsid.lab.blind.making import Settings, make_check

    out = tmp_path_factory.mktemp("made") / "check"
    with workers(1):
        make_check(out, Settings(seed=7, count=3, seconds=2.0))
    return out


def test_another_version_must_not_go_on(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ehsid, "__version__", "99.0")
    outcome = run("--out", str(made))
    assert outcome.exit_code == 2
    assert "this is 99.0; name a new folder" in words(outcome.stderr)


@pytest.mark.slow
def test_a_changed_answer_is_refused_before_and_after_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "check"

    class Cheats(StandIn):
        def answer(self, asked: Asked) -> Diagnosis:
            (out / "answers.json").write_text("{}")
            return super().answer(asked)

    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", Cheats(), raising=False)
    outcome = run("--out", str(out), *TINY)
    assert outcome.exit_code == 2
    assert "answers.json: changed since it was sealed" in words(outcome.stderr)
    assert not (out / "score.json").exists()
    outcome = run("--out", str(out))
    assert outcome.exit_code == 2
    assert "answers.json: changed since it was sealed" in words(outcome.stderr)


def test_without_numba_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("ehsid.lab.reality")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "numba", None)
    outcome = run("--out", str(tmp_path / "check"), *TINY)
    assert outcome.exit_code == 2
    assert words(install_line("lab")) in words(outcome.stderr)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_pictures")
def test_a_cluster_runs_the_same_cases(tmp_path: Path, dask_cluster: str) -> None:
    """Files are written here."""
    out = tmp_path / "check"
    outcome = run("--out", str(out), *TINY, "--dask", dask_cluster, workers=None)
    assert outcome.exit_code == 0, outcome.output
    results = sorted((out / "results").iterdir())
    assert len(results) == 3
    saw = [
        json.loads((one / "diagnosis.json").read_text(encoding="utf-8"))["provenance"]["settings"]
        for one in results
    ]
    assert {one["workers"] for one in saw} == {1}
    assert all(one["rig"] == f"rig-{path.name}" for one, path in zip(saw, results, strict=True))
    assert (out / "score.json").is_file()


def test_a_cluster_and_processes_are_refused_before_a_case_is_made(tmp_path: Path) -> None:
    out = tmp_path / "check"
    done = run("--out", str(out), "--dask", "tcp://127.0.0.1:9", workers="2")
    assert done.exit_code == 2
    assert "leave it away with --dask" in done.output
    assert not out.exists()


def test_a_bar_on_a_terminal_still_tells_of_errors() -> None:
    outcomes = [
        Outcome("good", {"diagnosis.json": b""}, "effects", 31.0),
        Outcome("bad", {"error.txt": b""}, "ValueError: [no] root", 2.0),
    ]
    console = Console(force_terminal=True, width=100, record=True)
    with console.capture() as captured:
        given = list(shown(outcomes, 2, 5, console))
    assert given == outcomes
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", captured.get())
    assert "5 of 5, bad: ValueError: [no] root, 2 s" in text
    assert "4 of 5, good" not in text


def test_no_time_to_go_is_told_before_it_can_be() -> None:
    outcomes = [Outcome(f"case{i}", {"diagnosis.json": b""}, "effects", 31.0) for i in range(2)]
    console = Console(force_terminal=False, width=100)
    with console.capture() as captured:
        list(shown(outcomes, 60, 60, console))
    first, second = captured.get().splitlines()
    assert first == "1 of 60, case0: effects, 31 s"
    assert second.startswith("2 of 60, case1: effects, 31 s; ")
    assert second.endswith(" left")


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_errors_are_results_and_the_exit_code_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Fails(StandIn):
        def answer(self, asked: Asked) -> Diagnosis:
            raise FloatingPointError("overflow")

    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", Fails(), raising=False)
    outcome = run("--out", str(tmp_path / "check"), *TINY)
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stderr.count("FloatingPointError: overflow") == 3
    assert len(list((tmp_path / "check" / "results").glob("*/error.txt"))) == 3


@pytest.mark.thorough
def test_the_diagnosis_itself_runs_from_end_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    out = tmp_path / "check"
    arguments = ["--count", "1", "--seconds", "3", "--sensors", "pressures", "--grade", "plain"]
    outcome = run("--out", str(out), *arguments, "--json")
    assert outcome.exit_code == 0, outcome.output
    score = json.loads(outcome.stdout)
    (case,) = score["cases"]
    (result,) = (out / "results").glob("*/diagnosis.json")
    diagnosis = json.loads(result.read_text(encoding="utf-8"))
    assert case["verdict"] == diagnosis["verdict"] != "failed"
    records = diagnosis["provenance"]["records"]
    assert [one["file"] for one in records] == [
        f"cases/{case['name']}/{name}.csv" for name in ("train", "validate")
    ]
    seal = json.loads((out / "seal.json").read_text(encoding="utf-8"))
    assert [one["sha256"] for one in records] == [seal["files"][one["file"]] for one in records]
