# SPDX-License-Identifier: MIT
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.records import make_record, read_record, write_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.injection import answer_path

BENCH = ROOT / "examples" / "rigs" / "bench.toml"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a short record, and the working directory in it."""
    monkeypatch.chdir(tmp_path)
    time_s = np.arange(400) * 1e-3
    volts = 4.0 * np.sin(2.0 * np.pi * 2.0 * time_s)
    columns = {"time_s": time_s, "command_v": volts, "position_m": 0.15 + 0.02 * volts}
    write_record(make_record({**columns, "lamp": volts}), tmp_path / "run.csv")
    return tmp_path


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli, ["inject", "run.csv", "--rig", str(BENCH), *arguments])


def asked(*effects: str, out: str = "made.csv") -> list[str]:
    options = []
    for effect in effects:
        options += ["--set" if "=" in effect else "--effect", effect]
    return [*options, "--out", out]


@pytest.mark.parametrize("out", ["made.csv", "made.parquet"])
def test_record_and_answer_are_written(here: Path, out: str) -> None:
    outcome = run(*asked("valve_dead_band", "overlap=0.04", out=out))
    assert outcome.exit_code == 0, outcome.output
    assert "valve_dead_band: overlap 0.04" in outcome.output
    before, after = read_record(here / "run.csv"), read_record(here / out)
    moved = after.column("command_v") - before.column("command_v")
    np.testing.assert_allclose(moved, 0.4 * np.sign(before.column("command_v")), atol=1e-14)
    np.testing.assert_array_equal(after.column("lamp"), before.column("lamp"))
    answer = json.loads((here / f"{out}.answer.json").read_text())
    assert answer["effects"] == {"valve_dead_band": {"overlap": 0.04}}
    for part, name in (("source", "run.csv"), ("record", out)):
        digest = hashlib.sha256((here / name).read_bytes()).hexdigest()
        assert answer[part] == {"file": name, "sha256": digest}
    assert sorted(path.name for path in here.iterdir()) == sorted(
        [".ehsid", "run.csv", out, f"{out}.answer.json"]
    )


def test_answer_as_json(here: Path) -> None:
    outcome = run(
        *asked("valve_hysteresis", "transport_delay", "half_width=0.02", "delay_s=0.01"), "--json"
    )
    assert outcome.exit_code == 0, outcome.output
    assert json.loads(outcome.stdout) == json.loads(answer_path(here / "made.csv").read_text())
    assert json.loads(outcome.stdout)["samples"]["dropped_at_end"] == 10


def test_a_parameter_of_two_effects_is_set_by_its_full_name(here: Path) -> None:
    effects = ("transport_delay", "position_delay")
    full = ("transport_delay.delay_s=0.01", "position_delay.delay_s=0.005")
    outcome = run(*asked(*effects, *full), "--json")
    assert outcome.exit_code == 0, outcome.output
    assert json.loads(outcome.stdout)["effects"] == {"transport_delay": {"delay_s": 0.015}}
    outcome = run(*asked(*effects, "delay_s=0.01"))
    assert outcome.exit_code == 2
    assert "transport_delay and position_delay have it" in outcome.stderr


def test_layout_of_the_rig_is_read_and_the_schema_written(here: Path) -> None:
    text = BENCH.read_text()
    text += '\n[columns]\nposition_m = { name = "stroke", unit = "mm" }\n'
    (here / "mapped.toml").write_text(text)
    record = read_record(here / "run.csv")
    assert record.time_s is not None
    columns = {"time_s": record.time_s, "command_v": record.column("command_v")}
    columns["stroke"] = 1e3 * record.column("position_m")
    write_record(make_record(columns), here / "mapped.csv")
    arguments = ["inject", "mapped.csv", "--rig", "mapped.toml"]
    arguments += asked("position_bias", "offset_m=0.001")
    outcome = CliRunner().invoke(cli, arguments)
    assert outcome.exit_code == 0, outcome.output
    made = read_record(here / "made.csv", layout=read_rig(here / "mapped.toml").columns)
    np.testing.assert_allclose(
        made.column("position_m"), record.column("position_m") + 1e-3, rtol=1e-12
    )
