# SPDX-License-Identifier: MIT
"""The command that calibrates the probabilities, on features and on the folder of a check."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from made_checks import candidate, diagnosis, made_answers, write_check
from made_machines import drawn_machines
from published_schemas import check_file
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.lab.blind.making import Settings, write_seal
from ehsid.lab.calibration.fitting import write_features

pytestmark = pytest.mark.usefixtures("blank_pictures")


def run(*arguments: object) -> Any:
    return CliRunner().invoke(cli, ["gap-calibrate", *map(str, arguments), "--workers", "1"])


def words(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture
def features(tmp_path: Path) -> Path:
    path = tmp_path / "features.jsonl"
    write_features(path, drawn_machines(60, 1))
    return path


@pytest.fixture
def check(tmp_path: Path) -> Path:
    weighed = {**candidate([], 1.0, 1.0, 10), "left": 1.0, "small": 0.0, "probability": 0.9}
    out = write_check(
        tmp_path / "check", made_answers(9), lambda *_: diagnosis("no_gap", candidates=[weighed])
    )
    (next((out / "results").iterdir()) / "diagnosis.json").unlink()
    write_seal(out, Settings(count=9))
    return out


@pytest.mark.slow
def test_features_give_a_page_a_file_and_the_features_again(features: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    outcome = run("--features", features, "--out", out)
    assert outcome.exit_code == 0, outcome.output
    assert (out / "features.jsonl").read_bytes() == features.read_bytes()
    check_file(out / "calibration.json")
    found = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert found["machines"] == 60
    page = (out / "calibration.html").read_text(encoding="utf-8")
    worst = f"{found['families'][0]['trait']}: {found['families'][0]['family']}"
    # The worst family stands in the first sentence and in the first row of the first table.
    assert f"left out is {worst}." in words(outcome.stdout)
    assert re.split('<th scope="row" class="[a-z]+">', page)[1].startswith(f"{worst}<")
    assert "could have come from the same generator" in words(outcome.stdout)


@pytest.mark.slow
def test_a_check_that_still_runs_gives_its_finished_cases(check: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    outcome = run(check, "--out", out, "--json")
    assert outcome.exit_code == 0, outcome.output
    found = json.loads(outcome.stdout)
    assert (found["machines"], found["left_out"]) == (8, {"not finished": 1})
    again = run("--features", out / "features.jsonl", "--out", tmp_path / "again", "--json")
    assert json.loads(again.stdout) == {**found, "left_out": {}}


@pytest.mark.slow
def test_several_checks_and_files_count_together(check: Path, tmp_path: Path) -> None:
    features, other = tmp_path / "some.jsonl", tmp_path / "none.jsonl"
    write_features(features, drawn_machines(10, 1))
    write_features(other, [])
    outcome = run(check, "--features", features, other, "--out", tmp_path / "out", "--json")
    assert outcome.exit_code == 0, outcome.output
    assert json.loads(outcome.stdout)["machines"] == 18


def test_a_check_without_finished_cases_is_refused(check: Path, tmp_path: Path) -> None:
    for path in check.glob("results/*/diagnosis.json"):
        path.rename(path.with_name("error.txt"))
    outcome = run(check, "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert "no finished case with probabilities (8 failed, 1 not finished)" in words(outcome.stderr)


def test_the_features_that_are_read_are_not_overwritten(features: Path) -> None:
    before = features.read_bytes()
    outcome = run("--features", features, "--out", features.parent)
    assert outcome.exit_code == 2
    assert "this is an input of the command" in words(outcome.stderr)
    assert features.read_bytes() == before
