# SPDX-License-Identifier: MIT
"""`ehsid app` where its packages are missing, and what it imports."""

from __future__ import annotations

import fcntl
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ehsid.harness.cli import cli

pytestmark = pytest.mark.slow

WIDE = {"COLUMNS": "4000"}  # no message is broken into lines


def test_its_help_names_the_extra_without_importing_it() -> None:
    outcome = CliRunner().invoke(cli, ["app", "--help"], env={"COLUMNS": "200"})
    assert outcome.exit_code == 0
    assert "pip install 'ehsid[app,logs]'" in outcome.output


def test_a_port_that_is_taken_is_told(tmp_path: Path) -> None:
    pytest.importorskip("panel", reason="the extra app is not installed")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        command = [sys.executable, "-m", "ehsid", "app", str(tmp_path), "--port", port]
        outcome = subprocess.run(command, capture_output=True, text=True, check=False)
    assert outcome.returncode == 2
    assert f"--port {port}: this port is taken" in outcome.stderr
    assert "Traceback" not in outcome.stderr


@pytest.mark.parametrize("folder", ["file/machines", "file", "x" * 300])
def test_a_folder_that_cannot_be_made_is_told(folder: str, tmp_path: Path) -> None:
    pytest.importorskip("panel", reason="the extra app is not installed")
    (tmp_path / "file").touch()
    outcome = CliRunner().invoke(cli, ["app", str(tmp_path / folder)], env=WIDE)
    assert outcome.exit_code == 2
    assert outcome.stdout == ""
    assert f"{folder}: cannot be used as the folder of the workbench (" in outcome.stderr
    assert "Traceback" not in outcome.stderr


# Tornado itself leaves the socket open whose bind has failed.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_where_the_port_is_taken_the_folder_is_free_again(tmp_path: Path) -> None:
    server = pytest.importorskip("ehsid.workbench.server", reason="the extra app is not installed")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(OSError, match="in use"):
            server.serve(tmp_path, taken.getsockname()[1], ready=pytest.fail)
    folder = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(folder)
