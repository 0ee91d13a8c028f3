# SPDX-License-Identifier: MIT
"""Commands print the model or what to try, and the next command, which runs as it is."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import model16
import numpy as np
import pytest
from scipy.signal import lfilter
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import cli

pytestmark = pytest.mark.usefixtures("blank_pictures")


def run(*arguments: str) -> Any:
    outcome = CliRunner().invoke(cli, list(arguments), env={"COLUMNS": "300"})
    assert outcome.exit_code == 0, outcome.output
    return outcome


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """Model (16) with white noise, in a file whose name has a space."""
    rng = np.random.default_rng(2)
    u, e = rng.choice([-1.0, 1.0], size=3000), 0.02 * rng.normal(size=3000)
    path = tmp_path / "my log.csv"
    rows = np.column_stack((0.05 * np.arange(u.size), u, model16.output(u, e)))
    np.savetxt(path, rows, delimiter=",", header="time_s,u,y", comments="", fmt="%.12g")
    return path


@pytest.fixture
def no_servo(tmp_path: Path) -> Path:
    """A stable plant of third order, which does not integrate: it has coefficients only."""
    rng = np.random.default_rng(2)
    u, e = rng.choice([-1.0, 1.0], size=3000), 0.02 * rng.normal(size=3000)
    a = np.poly([0.7 + 0.3j, 0.7 - 0.3j, 0.8]).real
    y = lfilter([0.0, 0.05, 0.06, 0.02], a, u) + lfilter([1.0], a, e)
    path = tmp_path / "my log.csv"
    rows = np.column_stack((0.05 * np.arange(u.size), u, y))
    np.savetxt(path, rows, delimiter=",", header="time_s,u,y", comments="", fmt="%.12g")
    return path


COLUMNS = ("--input", "u", "--output", "y")


def next_of(text: str) -> list[str]:
    """The words of the command below "Next:"."""
    return shlex.split(text.split("Next:\n")[1].splitlines()[0])


def test_identify_estimate_and_export_follow_each_other(record: Path, tmp_path: Path) -> None:
    identified = run("identify", str(record), *COLUMNS, "--orders", "3")
    for words in ("a1 ", "offset", "pole", "zero", "Velocity gain K = ", "omega_n = ", "xi = "):
        assert words in identified.stdout
    following = next_of(identified.stdout)
    assert following[:3] == ["ehsid", "estimate", str(record)]
    assert following[3:] == [*COLUMNS, "--na", "3", "--nb", "3", "--nk", "1"]
    estimated = run(*following[1:])
    assert ", converged" in estimated.stdout
    assert "What to try" not in estimated.stdout
    # The servo of model (16) stands before its coefficients.
    servo, parameters = estimated.stdout.split("parameter ")
    assert "90 % interval" in servo
    assert "omega_n" in servo
    assert "b3" in parameters
    exporting = next_of(estimated.stdout)
    exporting[-1] = str(tmp_path / exporting[-1])
    run(*exporting[1:])
    assert (tmp_path / "servo_configuration.hpp").is_file()


@pytest.mark.slow
def test_json_has_the_same_and_the_files_too(record: Path, tmp_path: Path) -> None:
    arguments = [str(record), *COLUMNS, "--json", "--out", str(tmp_path / "out")]
    found = json.loads(run("identify", *arguments, "--orders", "3").stdout)
    following = found.pop("next_command")
    assert following.startswith("ehsid estimate '")
    assert found == json.loads((tmp_path / "out" / "identify.json").read_text())
    servo = found["dynamics"]["servo"]
    # docs/servo_model.md reads model (16) with a sampling time of 0.05 s.
    assert servo["omega_n"]["value"] == pytest.approx(
        12.95, abs=4.0 * servo["omega_n"]["deviation"]
    )
    assert servo["xi"]["value"] == pytest.approx(0.471, abs=4.0 * servo["xi"]["deviation"])
    estimated = json.loads(run("estimate", *arguments).stdout)
    following = estimated.pop("next_command")
    assert following.startswith("ehsid export '")
    assert estimated == json.loads((tmp_path / "out" / "estimate.json").read_text())
    assert estimated["advice"] == {"trials": [], "lacks": []}


def test_what_does_not_converge_says_what_to_try_and_that_helps(no_servo: Path) -> None:
    arguments = [
        "estimate",
        str(no_servo),
        *COLUMNS,
        "--forgetting",
        "constant",
        "--lambda0",
        "0.95",
    ]
    outcome = run(*arguments)
    assert "not converged" in outcome.stdout
    assert "Next:" not in outcome.stdout
    advised = "--forgetting constant --lambda0 0.999"
    assert f"With `{advised}` the estimate converges" in outcome.stdout
    again = run("estimate", str(no_servo), *COLUMNS, *advised.split())
    assert ", converged" in again.stdout


def test_python_says_the_same(record: Path) -> None:
    names = {"input": "u", "output": "y"}
    summary = ehsid.identify(record, **names, orders=3).summary()
    for words in ("Velocity gain K = ", "omega_n = ", "Next: ehsid.estimate(", "na=3, nb=3, nk=1"):
        assert words in summary


def test_python_says_the_same_of_what_does_not_converge(no_servo: Path) -> None:
    slow = ehsid.estimate(no_servo, input="u", output="y", forgetting=ehsid.Constant(0.95))
    assert "With `forgetting=ehsid.Constant(0.999)` the estimate converges" in slow.summary()


def test_orders_that_the_estimator_does_not_take_have_no_next_command(record: Path) -> None:
    outcome = run("identify", str(record), *COLUMNS, "--orders", "7", "--delays", "1")
    assert "Next:" not in outcome.stdout
    assert "na = nb = 7" in outcome.stdout or "na = 7" in outcome.stdout
