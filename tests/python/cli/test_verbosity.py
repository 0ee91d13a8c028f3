# SPDX-License-Identifier: MIT
"""-v adds what is done, -q leaves only errors; both stand before or behind the command."""

from __future__ import annotations

import logging
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from ehsid.harness.cli import VERBS, cli
from ehsid.harness.cli.console import set_verbosity
from ehsid.harness.cli.lazy import Verb


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    logger = logging.getLogger("ehsid")
    level = logger.level
    yield
    set_verbosity(verbose=False, quiet=False)
    logger.setLevel(level)


@pytest.fixture
def log(tmp_path: Path) -> str:
    """A log of another layout, of which commands show what was taken for what."""
    path = tmp_path / "log.txt"
    rows = [f"{k / 100:.2f};{(k * 7919 % 13) - 6};{k * 0.1 + (k % 7)}" for k in range(300)]
    path.write_text("Time [s];Valve [V];Stroke [mm]\n" + "\n".join(rows))
    return str(path)


def run(*arguments: str) -> Any:
    outcome = CliRunner().invoke(cli, list(arguments))
    assert outcome.exit_code == 0, outcome.output
    return outcome


def test_quiet_leaves_the_result_and_nothing_on_stderr(log: str) -> None:
    usual = run("estimate", log, "--na", "1", "--nb", "1")
    assert "taken for" in usual.stderr
    for arguments in (["-q", "estimate", log], ["estimate", log, "--quiet"]):
        quiet = run(*arguments, "--na", "1", "--nb", "1")
        assert quiet.stderr == ""
        assert quiet.stdout == usual.stdout


def test_quiet_does_not_silence_an_error() -> None:
    outcome = CliRunner().invoke(cli, ["estimate", "nowhere.csv", "-q"])
    assert outcome.exit_code == 2
    assert "nowhere.csv" in outcome.stderr


@pytest.mark.parametrize("before", [True, False])
def test_verbose_tells_of_each_record(before: bool, log: str) -> None:
    arguments = ["estimate", log, "--na", "1", "--nb", "1"]
    outcome = run(*(["-v", *arguments] if before else [*arguments, "-v"]))
    assert "log.txt: 300 samples" in outcome.stderr
    assert "300 samples" not in run(*arguments).stderr


def test_both_at_once_are_refused() -> None:
    for arguments in (["-v", "effects", "-q"], ["effects", "-q", "-v"]):
        outcome = CliRunner().invoke(cli, arguments)
        assert outcome.exit_code == 2
        assert "expected one of them" in outcome.stderr


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_every_command_has_both(verb: Verb) -> None:
    names = {name for parameter in verb.load().params for name in parameter.opts}
    assert {"-v", "--verbose", "-q", "--quiet"} <= names


def test_the_package_alone_says_nothing() -> None:
    script = "import ehsid, logging; logging.getLogger('ehsid').warning('said')"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
