# SPDX-License-Identifier: MIT
"""`ehsid import`, and the walk from each kind of log to a report."""

from __future__ import annotations

import json
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from log_files import COUNT, TIME_S, TRUTH, WRITERS, write_excel, write_german_text, write_mf4
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.records import read_record

DATA = ROOT / "examples" / "data"
TRUTH_COLUMNS = (TIME_S, TRUTH["command_v"], TRUTH["position_m"])
BENCH = str(ROOT / "examples" / "rigs" / "bench.toml")


# Kinds of `script/test`: the others differ in what reads them, which test_log_kinds.py has.
EVERY_DAY = {"text"}


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, [str(one) for one in arguments])


@pytest.mark.slow
@pytest.mark.parametrize("command", ["import", "identify", "estimate", "gap", "simulate"])
def test_help_shows_how_a_unit_is_named(command: str) -> None:
    """Square brackets would be markup of the terminal."""
    assert "[mm]" in run(command, "--help").output


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=() if kind in EVERY_DAY else pytest.mark.thorough)
        for kind in WRITERS
    ],
)
def test_from_each_kind_of_log_to_a_report(tmp_path: Path, kind: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the writers
        log = WRITERS[kind](tmp_path)
        out = tmp_path / "results"
        outcome = run("identify", log, "--orders", "2-3", "--delays", "1-2", "--out", out)
    assert outcome.exit_code == 0, outcome.output
    shown = " ".join(outcome.stderr.split())
    assert "read as" in shown
    assert "command_v" in shown
    assert "position_m" in shown
    results = json.loads((out / "identify.json").read_text())
    columns = {one["channel"]: one for one in results["reading"]["columns"]}
    assert {"time_s", "command_v", "position_m"} == set(columns)
    assert all(one["why"] for one in columns.values())
    assert (out / "identify_bode.png").is_file()


TEXT_COLUMN = "columns without numbers are left out: 'operator', 'mode'"


def with_text_columns(path: Path, delimiter: str, names: str) -> Path:
    """A record with two columns of text; with other names it is a log of another layout."""
    time_s, command, position = TRUTH_COLUMNS
    lines = [delimiter.join([*names.split(","), "operator", "mode"])]
    for row in zip(time_s, command, position, strict=True):
        lines.append(delimiter.join([*(f"{number:.9g}" for number in row), "Anna", "auto"]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("delimiter", "names"),
    [
        (";", "Time [s],Command [V],Position [m]"),
        pytest.param(",", "time_s,command_v,position_m", marks=pytest.mark.thorough),
    ],
    ids=["another layout", "schema"],
)
@pytest.mark.parametrize(
    "command",
    [
        ("import",),
        ("identify", "--orders", "2", "--delays", "1"),
        ("estimate", "--out", "estimate"),
        ("export", "--na", "1", "--nb", "1", "--out", "header.h"),
        ("rig", "check", BENCH),
        (
            "inject",
            "--rig",
            BENCH,
            "--effect",
            "transport_delay",
            "--set",
            "delay_s=0.01",
            "--out",
            "i.csv",
        ),
        ("simulate", BENCH, "--out", "s.csv", "--command"),
    ],
    ids=lambda command: " ".join(command[:2]).split(" -")[0],
)
def test_every_command_says_which_columns_hold_no_numbers(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: tuple[str, ...],
    delimiter: str,
    names: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    log = with_text_columns(tmp_path / "log.csv", delimiter, names)
    outcome = run(*command, log)
    assert outcome.exit_code == 0, outcome.output
    assert " ".join(outcome.output.split()).count(TEXT_COLUMN) == 1


def test_a_text_column_that_is_asked_for_is_refused_by_its_cell(tmp_path: Path) -> None:
    log = with_text_columns(tmp_path / "log.csv", ",", "time_s,command_v,position_m")
    outcome = run("identify", log, "--output", "operator")
    assert outcome.exit_code == 2
    assert "the text 'Anna' is not a number" in outcome.output


def test_one_damaged_cell_is_no_column_of_text(tmp_path: Path) -> None:
    log = with_text_columns(tmp_path / "log.csv", ",", "time_s,command_v,position_m")
    lines = log.read_text(encoding="utf-8").split("\n")
    lines[5] = lines[5].replace(lines[5].split(",")[2], "1.5x")
    log.write_text("\n".join(lines), encoding="utf-8")
    outcome = run("import", log)
    assert outcome.exit_code == 2
    assert "row 6, column 'position_m': the text '1.5x' is not a number" in outcome.output


def test_import_keeps_a_log_as_a_record(tmp_path: Path) -> None:
    log, out = write_german_text(tmp_path), tmp_path / "rec.parquet"
    outcome = run("import", log, "--out", out)
    assert outcome.exit_code == 0, outcome.output
    text = " ".join(outcome.stdout.split())
    assert "read as text, columns separated by ';', decimal comma" in text
    assert f"{COUNT} samples, every 0.002 s" in text
    record = read_record(out)
    assert record.origin is None  # it follows the schema
    for name, true in TRUTH.items():
        limit = 5e-9 * float(np.max(np.abs(true)))  # nine digits
        np.testing.assert_allclose(record.column(name), true, rtol=0, atol=limit)
    block = outcome.stdout[outcome.stdout.index("[columns]") :].split("\n\n")[0]
    assert tomllib.loads(block)["columns"]["position_m"] == {"name": "Stroke", "unit": "mm"}


@pytest.mark.slow
def test_the_printed_block_in_a_rig_reads_the_log(tmp_path: Path) -> None:
    log = write_german_text(tmp_path)
    outcome = run("import", log)
    block = outcome.stdout[outcome.stdout.index("[columns]") :].split("\n\n")[0]
    rig = tmp_path / "rig.toml"
    rig.write_text((ROOT / "examples" / "rigs" / "bench.toml").read_text() + "\n" + block)
    out = tmp_path / "sim.csv"
    outcome = run("simulate", rig, "--command", log, "--out", out)
    assert outcome.exit_code == 0, outcome.output
    assert len(read_record(out)) == COUNT


def test_import_as_json(tmp_path: Path) -> None:
    outcome = run("import", write_mf4(tmp_path), "--json")
    summary = json.loads(outcome.stdout)
    assert summary["samples"] == COUNT
    assert summary["dt_s"] == pytest.approx(0.002)
    position = next(one for one in summary["reading"]["columns"] if one["channel"] == "position_m")
    assert (position["column"], position["unit"], position["factor"]) == ("Stroke", "mm", 1e-3)


def test_a_record_of_the_schema_needs_no_import() -> None:
    outcome = run("import", ROOT / "tests" / "python" / "data" / "emps" / "emps.csv")
    assert "follows the schema of records: nothing had to be changed" in outcome.stdout
    assert outcome.stderr == ""


@pytest.mark.slow
def test_map_and_dt_say_otherwise(tmp_path: Path) -> None:
    log = write_excel(tmp_path)
    options = ("--map", "position_m=Stroke [cm]", "--dt", "0.004")
    outcome = run("import", log, *options, "--out", tmp_path / "rec.csv")
    assert outcome.exit_code == 0, outcome.output
    record = read_record(tmp_path / "rec.csv")
    assert record.dt_s == pytest.approx(0.004)
    assert np.ptp(record.column("position_m")) == pytest.approx(1.0, rel=1e-3)  # 100 mm as cm


@pytest.mark.parametrize(
    "verb", ["identify", "estimate", "export", "experiment", "gap", "inject", "simulate", "import"]
)
def test_every_command_that_reads_a_record_has_the_options(verb: str) -> None:
    text = run(verb, "--help").stdout
    assert "--map" in text
    assert "--dt" in text
