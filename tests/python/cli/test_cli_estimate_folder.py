# SPDX-License-Identifier: MIT
"""`ehsid estimate` on a folder: every record as alone, one page, and what could not be used."""

import csv
import json
from pathlib import Path
from typing import Any

import model16
import numpy as np
import pytest
from published_schemas import check_file
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.records import make_record, write_record

pytestmark = pytest.mark.usefixtures("blank_pictures")

SETTINGS = ("--na", "3", "--nb", "3", "--forgetting", "constant", "--lambda0", "0.999")


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli, ["estimate", *arguments], env={"COLUMNS": "400"})


def add(path: Path, seed: int, gain: float = 1.0, size: int = 800, dt_s: float = 0.01) -> None:
    u, y = model16.signals(seed, size)
    columns = {"time_s": dt_s * np.arange(size), "command_v": u, "position_m": gain * y}
    write_record(make_record(columns, name=path.stem), path)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Eighteen records, more than run side by side at once: one is far from the others."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logs").mkdir()
    for seed in range(18):
        name = f"run{seed:02d}.{'parquet' if seed == 3 else 'csv'}"
        add(tmp_path / "logs" / name, seed, 3.0 if seed == 7 else 1.0, 700 + 13 * seed)
    return tmp_path


def alone(file: str, *options: str) -> dict[str, Any]:
    """Return the estimate of one record, without what the command says of it for people."""
    found: dict[str, Any] = json.loads(run(f"logs/{file}", *options, "--json").stdout)
    return {key: value for key, value in found.items() if key not in ("advice", "next_command")}


@pytest.mark.slow
def test_every_record_is_as_alone_and_the_others_are_named(here: Path) -> None:
    logs = here / "logs"
    (logs / "broken.csv").write_text("time_s,command_v,position_m\n0,1,abc\n")
    add(logs / "short.csv", 1, size=20)
    (logs / "notes.txt").write_text("not a record")
    (logs / ".hidden.csv").write_text("not a record")
    (logs / "older").mkdir()
    add(logs / "older" / "run.csv", 1)
    before = {path: path.read_bytes() for path in logs.rglob("*") if path.is_file()}
    outcome = run("logs", *SETTINGS, "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    assert {path: path.read_bytes() for path in logs.rglob("*") if path.is_file()} == before
    assert "logs/broken.csv, row 2, column 'position_m': the text 'abc'" in outcome.stderr
    assert "logs/short.csv: 20 samples leave" in outcome.stderr
    assert "Far from the others: run07.csv." in outcome.stdout
    assert "2 files could not be used" in outcome.stdout
    files = {path.name for path in (here / "out").iterdir()}
    assert files == {".ehsid", "estimates.html", "estimates.json", "estimates.csv"}
    check_file(here / "out" / "estimates.json")
    found = json.loads((here / "out" / "estimates.json").read_text(encoding="utf-8"))
    assert len(found["records"]) == 18
    for one in found["records"]:
        assert one["estimate"] == alone(one["file"], *SETTINGS)
        assert one["dt_s"] == pytest.approx(0.01)
    assert {one["file"] for one in found["outliers"]} == {"run07.csv"}
    assert set(found["failed"]) == {"broken.csv", "short.csv"}
    with (here / "out" / "estimates.csv").open(encoding="utf-8", newline="") as text:
        rows = list(csv.DictReader(text))
    assert [row["file"] for row in rows[:18]] == [one["file"] for one in found["records"]]
    for row, one in zip(rows, found["records"], strict=False):
        b1 = one["estimate"]["parameters"]["b1"]
        assert [float(row[name]) for name in ("b1", "b1_low95", "b1_high95")] == [
            b1["value"],
            *b1["ci95"],
        ]
        gain = one["estimate"]["servo"]["gain"]
        assert [float(row[name]) for name in ("K", "K_low90", "K_high90")] == [
            gain["value"],
            *gain["ci90"],
        ]
        assert row["converged"] == str(one["estimate"]["converged"]).lower()
    assert [row["file"] for row in rows[18:]] == ["broken.csv", "short.csv"]
    assert "the text 'abc' is not a number" in rows[18]["message"]
    page = (here / "out" / "estimates.html").read_text(encoding="utf-8")
    assert page.index("data:image/svg+xml") < page.index("run17.csv")
    assert "https://" not in page
    assert "abc" in page


@pytest.mark.thorough
def test_json_is_the_file(here: Path) -> None:
    outcome = run("logs", *SETTINGS, "--json", "--out", "out")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout == (here / "out" / "estimates.json").read_text(encoding="utf-8")
    again = run("logs", *SETTINGS, "--json")
    assert again.stdout == outcome.stdout


@pytest.mark.slow
def test_logs_that_are_read_in_the_same_way_are_told_once(here: Path) -> None:
    for path in (here / "logs").iterdir():
        path.unlink()
    for seed in range(4):
        u, y = model16.signals(seed, 600)
        rows = [
            f"{10 * k};{a:.6f};{1e3 * b:.6f}" for k, (a, b) in enumerate(zip(u, y, strict=True))
        ]
        text = "\n".join(["t [ms];Valve [V];Stroke [mm]", *rows])
        (here / "logs" / f"log{seed}.csv").write_text(text + "\n")
    maps = ("--map", "command_v=Valve", "--map", "position_m=Stroke")
    outcome = run("logs", *SETTINGS, *maps, "--json")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stderr.count("read as text") == 1
    assert "log0.csv and 3 more: read as text" in outcome.stderr
    for one in json.loads(outcome.stdout)["records"]:
        assert one["estimate"] == alone(one["file"], *SETTINGS, *maps)
        assert one["estimate"]["reading"]["columns"]
