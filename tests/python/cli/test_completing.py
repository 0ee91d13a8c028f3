# SPDX-License-Identifier: MIT
"""What a shell is offered, through the environment variables of its script."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ehsid.harness.cli import cli


def completed(line: str, shell: str = "bash") -> list[str]:
    """The lines that the script of a shell gets for a command line with the cursor at its end."""
    words = line.split(" ")
    environment = {
        "_EHSID_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": "\n".join(words),
        "COMP_CWORD": str(len(words) - 1),
        "_TYPER_COMPLETE_ARGS": line,
    }
    return CliRunner().invoke(cli, [], env=environment, prog_name="ehsid").stdout.split("\n")[:-1]


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("ehsid ga", ["gap", "gap-edit", "gap-fleet", "gap-check", "gap-calibrate"]),
        ("ehsid rig ", ["new", "check"]),
        ("ehsid gap --exclude-effect coul", ["coulomb_friction", "coulomb_friction_sides"]),
        ("ehsid gap-fleet dir --fail-on no_gap,amb", ["no_gap,ambiguous"]),
        ("ehsid estimate --forgetting f", ["f-ratio"]),
        ("ehsid estimate --method ri", ["riv"]),
        ("ehsid simulate rig.toml --effect load_force.", ["load_force.force_n="]),
        ("ehsid inject --effect gai", ["gain"]),
        ("ehsid identify --ord", ["--orders"]),
        ("ehsid identify rec", []),  # the shell then offers files
    ],
)
def test_commands_options_and_values_are_offered(line: str, offered: list[str]) -> None:
    assert [word for word in completed(line) if word] == offered


def test_zsh_gets_the_same_and_files_where_there_is_nothing() -> None:
    assert "coulomb_friction_sides" in "".join(completed("ehsid gap --exclude-effect coul", "zsh"))
    assert completed("ehsid identify rec", "zsh") == ["_files"]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_the_script_for_bash_works_in_bash(tmp_path: Path) -> None:
    command = tmp_path / "ehsid"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m ehsid "$@"\n')
    command.chmod(0o755)
    script = """
eval "$(ehsid --show-completion bash)"
COMP_WORDS=(ehsid rig ch); COMP_CWORD=2
_ehsid_completion ehsid
echo "${COMPREPLY[@]}"
"""
    path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", script],
        capture_output=True,
        text=True,
        env={**os.environ, "PATH": path},
        check=False,
    )
    assert done.stdout == "check\n", done.stderr
