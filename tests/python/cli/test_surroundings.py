# SPDX-License-Identifier: MIT
"""Commands in odd surroundings: closed or full streams, settings that are none, foreign folders."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from sources import ROOT

from ehsid.harness.base.files import temporary_folder

BENCH = ROOT / "examples" / "rigs" / "bench.toml"
SIMULATE = (
    f"simulate {shlex.quote(str(BENCH))} --excitation steps --duration 2 --dt 0.01 --out s.csv"
)
CHECK = f"rig check {shlex.quote(str(BENCH))} s.csv"
HELP = "Choose order and delay of an ARX model"
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs a POSIX shell")


def run(
    folder: Path, arguments: str, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["sh", "-c", f"exec {shlex.quote(sys.executable)} -m ehsid {arguments}"],
        cwd=folder,
        env={**os.environ, **(environment or {})},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.thorough
@pytest.mark.parametrize("size", ["0", "1", "-5", "xx", "99999999", "9" * 5000])
def test_a_size_of_the_terminal_that_is_none_is_ignored(size: str, tmp_path: Path) -> None:
    usual = run(tmp_path, "--help", {"COLUMNS": "80"})
    outcome = run(tmp_path, "--help", dict.fromkeys(("COLUMNS", "LINES", "TERMINAL_WIDTH"), size))
    assert (outcome.returncode, outcome.stdout) == (0, usual.stdout)


@pytest.mark.thorough
@pytest.mark.parametrize("optimised", ["1", "2"])
def test_the_help_is_whole_without_docstrings(optimised: str, tmp_path: Path) -> None:
    said = run(tmp_path, "identify --help", {"PYTHONOPTIMIZE": optimised}).stdout
    assert HELP in said
    assert said == run(tmp_path, "identify --help").stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        ("rig new --out r.toml <&-", 2, "--bore, --rod, --stroke"),
        pytest.param("effects -v <&- 2>&-", 0, "", marks=pytest.mark.thorough),
        pytest.param(f"{SIMULATE} -v 2>&-", 0, "", marks=pytest.mark.thorough),
        (f"{SIMULATE} >&- 2>&-", 0, ""),
        pytest.param("effects >&-", 0, "", marks=pytest.mark.thorough),
        pytest.param("effects -v 2>/dev/full", 0, "", marks=pytest.mark.thorough),
        pytest.param("effects --nothing 2>/dev/full", 2, "", marks=pytest.mark.thorough),
        ("effects >/dev/full", 2, "what is printed cannot be written to stdout (No space left"),
        pytest.param(
            "effects --json >/dev/full",
            2,
            "cannot be written to stdout",
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            "--help >/dev/full", 2, "cannot be written to stdout", marks=pytest.mark.thorough
        ),
        pytest.param(
            "--version >/dev/full", 2, "cannot be written to stdout", marks=pytest.mark.thorough
        ),
        pytest.param(
            "identify --help >/dev/full",
            2,
            "cannot be written to stdout",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_streams_that_are_closed_or_full(
    arguments: str, code: int, says: str, tmp_path: Path
) -> None:
    outcome = run(tmp_path, arguments)
    assert outcome.returncode == code, outcome.stderr
    assert says in outcome.stderr
    assert "Traceback" not in outcome.stderr
    assert len(outcome.stderr.splitlines()) <= 1
    assert (tmp_path / "s.csv").exists() == arguments.startswith("simulate")


@pytest.mark.thorough
def test_a_result_is_whole_although_stdout_is_full(tmp_path: Path) -> None:
    outcome = run(tmp_path, f"{SIMULATE} >/dev/full")
    whole = tmp_path / "whole"
    whole.mkdir()
    assert (outcome.returncode, run(whole, SIMULATE).returncode) == (2, 0)
    assert (tmp_path / "s.csv").read_bytes() == (whole / "s.csv").read_bytes()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("place", "style"),
    [
        ("folder", b"text.usetex: True\nfont.family: cursive\naxes.facecolor: red\n"),
        ("folder", b"\xff\xfe\x00"),
        ("MATPLOTLIBRC", b"axes.facecolor: red\n"),
        ("MPLCONFIGDIR", b"no.such.key: 1\n"),
    ],
)
def test_a_style_of_others_changes_no_picture(place: str, style: bytes, tmp_path: Path) -> None:
    pictures = []
    for name, content in (("usual", None), ("other", style)):
        folder = tmp_path / name
        folder.mkdir()
        file, environment = folder / "matplotlibrc", {}
        if place != "folder":
            file = tmp_path / f"{name}_style" / "matplotlibrc"
            file.parent.mkdir()
            environment = {place: str(file.parent)}
        if content is not None:
            file.write_bytes(content)
        assert run(folder, SIMULATE).returncode == 0
        outcome = run(folder, f"{CHECK} --out check", environment)
        assert outcome.returncode == 0, outcome.stderr
        assert outcome.stderr == ""
        pictures.append([path.read_bytes() for path in sorted(folder.glob("check/*.png"))])
    assert pictures[0]
    assert pictures[0] == pictures[1]


def test_temporary_folders_of_processes_that_were_killed_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    script = (
        "import os, signal; from ehsid.harness.base.files import temporary_folder\n"
        "with temporary_folder() as one: os.kill(os.getpid(), signal.SIGKILL)"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", script], env=environment, check=False)
    (left,) = tmp_path.iterdir()
    with temporary_folder() as first, temporary_folder() as second:
        assert not left.exists()
        assert {*tmp_path.iterdir()} == {first, second}
    assert not list(tmp_path.iterdir())
