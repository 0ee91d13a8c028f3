# SPDX-License-Identifier: MIT
import json
import re
from pathlib import Path

import model16
import numpy as np
import pytest
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"
BENCH = CRANE.parents[1] / "rigs" / "bench.toml"
COLUMNS = ["--input", "valve_opening", "--output", "oil_pressure"]


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["estimate", "identify"])
def test_real_record_gives_json_and_picture(verb: str, tmp_path: Path) -> None:
    arguments = [verb, str(CRANE), *COLUMNS, "--json", "--out", str(tmp_path)]
    outcome = CliRunner().invoke(cli, arguments)
    assert outcome.exit_code == 0, outcome.output
    told = json.loads(outcome.stdout)
    assert "next_command" in told
    written = json.loads((tmp_path / f"{verb}.json").read_text())
    assert written == {name: one for name, one in told.items() if name != "next_command"}
    assert (tmp_path / f"{verb}.png").stat().st_size > 10_000
    names = [f"{verb}.json", f"{verb}.png", *(["identify_bode.png"] if verb == "identify" else [])]
    assert sorted(path.name for path in tmp_path.iterdir()) == [".ehsid", *names]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "has_term"), [([], True), (["--offset"], True), (["--no-offset"], False)]
)
def test_an_estimate_has_a_constant_term_unless_it_is_not_wanted(
    option: list[str], has_term: bool
) -> None:
    outcome = CliRunner().invoke(cli, ["estimate", str(CRANE), *COLUMNS, "--json", *option])
    assert outcome.exit_code == 0, outcome.output
    assert ("offset" in json.loads(outcome.stdout)["parameters"]) == has_term


@pytest.mark.parametrize("noise", ["equation", "position"])
def test_estimate_says_whether_its_intervals_can_be_believed(noise: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    u, e = rng.choice([-1.0, 1.0], size=3000), 0.02 * rng.normal(size=3000)
    white = noise == "equation"
    y = model16.output(u, e) if white else model16.output(u, 0.0 * e) + e
    path = tmp_path / "record.csv"
    np.savetxt(path, np.column_stack((u, y)), delimiter=",", header="u,y", comments="")
    arguments = ["estimate", str(path), "--input", "u", "--output", "y"]
    outcome = CliRunner().invoke(cli, arguments, env={"COLUMNS": "1000"})
    assert outcome.exit_code == 0, outcome.output
    assert ("residuals are not white" in outcome.stdout) != white
    assert ("method `riv`" in outcome.stdout) != white
    assert ("not converged" in outcome.stdout) != white
    found = json.loads(CliRunner().invoke(cli, [*arguments, "--json"]).stdout)
    assert found["residuals_white"] == white
    assert (found["whiteness"] < 22.458) == white


@pytest.mark.slow
def test_identify_draws_the_frequency_response_and_tells_the_limit_of_the_gain(
    tmp_path: Path,
) -> None:
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], size=300), 4)
    y = 0.02 * np.concatenate([[0.0, 0.0], np.cumsum(u)[:-2]]) + 1e-6 * rng.normal(size=u.size)
    rows = "".join(f"{i / 100},{a},{b}\n" for i, (a, b) in enumerate(zip(u, y, strict=True)))
    path = tmp_path / "integrator.csv"
    path.write_text("time_s,command_v,position_m\n" + rows)
    arguments = ["identify", str(path), "--orders", "1", "--out", str(tmp_path / "out")]
    outcome = CliRunner().invoke(cli, arguments, env={"COLUMNS": "400"})
    assert outcome.exit_code == 0, outcome.output
    assert (tmp_path / "out" / "identify_bode.png").stat().st_size > 10_000
    found = re.search(
        r"stable up to k = ([\d.]+), where it oscillates at ([\d.]+) Hz", outcome.stdout
    )
    assert found is not None, outcome.stdout
    # With y(k) = y(k-1) + 0.02 u(k-2): z^2 - z + 0.02 k, whose roots leave the circle at |z|^2 = 1.
    assert float(found[1]) == pytest.approx(1.0 / 0.02, rel=0.02)
    # z + 1/z = 1: an angle of 60 degrees, a sixth of 100 Hz.
    assert float(found[2]) == pytest.approx(100.0 / 6.0, rel=0.02)


def test_the_limit_of_samples_is_settable(monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ["simulate", str(BENCH), "--excitation", "steps", "--duration", "0.2"]
    monkeypatch.setenv("EHSID_MAX_SAMPLES", "199")
    outcome = CliRunner().invoke(cli, arguments)
    assert outcome.exit_code == 2
    assert "200 samples: expected at most 199" in outcome.stderr
    assert "EHSID_MAX_SAMPLES" in outcome.stderr
    monkeypatch.setenv("EHSID_MAX_SAMPLES", "200")
    assert CliRunner().invoke(cli, arguments).exit_code == 0
