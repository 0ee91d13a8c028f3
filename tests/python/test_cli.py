# SPDX-License-Identifier: MIT
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ehsid.harness.cli import app

CRANE = Path(__file__).parents[2] / "examples" / "data" / "hydraulic_crane.csv"
COLUMNS = ["--input", "valve_opening", "--output", "oil_pressure"]


@pytest.mark.parametrize("verb", ["estimate", "identify"])
def test_real_record_gives_json_and_picture(verb: str, tmp_path: Path) -> None:
    arguments = [verb, str(CRANE), *COLUMNS, "--json", "--out", str(tmp_path)]
    outcome = CliRunner().invoke(app, arguments)
    assert outcome.exit_code == 0, outcome.output
    assert json.loads(outcome.stdout) == json.loads((tmp_path / f"{verb}.json").read_text())
    assert (tmp_path / f"{verb}.png").stat().st_size > 10_000
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{verb}.json", f"{verb}.png"]


@pytest.mark.parametrize("verb", ["estimate", "identify"])
def test_missing_file_is_one_message_and_code_2(verb: str) -> None:
    outcome = CliRunner().invoke(app, [verb, "nowhere.csv"])
    assert outcome.exit_code == 2
    assert "nowhere.csv" in outcome.stderr
    assert "Traceback" not in outcome.output


def test_order_outside_the_compiled_range_names_the_range() -> None:
    outcome = CliRunner().invoke(app, ["estimate", str(CRANE), *COLUMNS, "--na", "7"])
    assert outcome.exit_code == 2
    assert "na must be in 1..6, got 7" in outcome.stderr


def test_constant_input_is_named(tmp_path: Path) -> None:
    rows = "".join(f"1.0,{y}\n" for y in np.random.default_rng(1).normal(size=300))
    path = tmp_path / "constant.csv"
    path.write_text("u,y\n" + rows)
    outcome = CliRunner().invoke(app, ["estimate", str(path), "--input", "u", "--output", "y"])
    assert outcome.exit_code == 2
    assert "u is constant" in outcome.stderr
