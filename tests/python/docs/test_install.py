# SPDX-License-Identifier: MIT
"""The page "Install", and how a user goes on after script/demo."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib

import pytest
from printed_pages import DOCS, text_of
from sources import ROOT

from ehsid.harness.base.error_words import install_line

PAGE = text_of(DOCS / "install.md")
PROJECT = tomllib.loads(text_of(ROOT / "pyproject.toml"))["project"]
# Extras of those who change ehsid; the page sends them to CONTRIBUTING.md.
FOR_DEVELOPERS = {"test", "browser", "lint", "bench", "docs", "fuzz", "wheel"}


def test_the_page_has_every_extra_of_a_user() -> None:
    extras = set(re.findall(r"^\| `(\w+)` \|", PAGE, flags=re.MULTILINE))
    assert extras == set(PROJECT["optional-dependencies"]) - FOR_DEVELOPERS


def test_scripts_and_options_of_the_page_are_there() -> None:
    scripts = set(re.findall(r"script/\w+", PAGE))
    assert len(scripts) >= 3
    assert all((ROOT / script).is_file() for script in scripts)
    assert "option(EHSID_BUILD_C " in text_of(ROOT / "CMakeLists.txt")
    assert "EHSID_BUILD_C=ON" in PAGE


def test_the_line_for_an_extra_names_the_python_that_runs() -> None:
    python, *rest = shlex.split(install_line("logs"))
    assert python == sys.executable
    assert rest == ["-m", "pip", "install", "ehsid[logs]"]


@pytest.mark.thorough
@pytest.mark.parametrize("page", ["README.md", "docs/install.md"])
def test_the_first_command_of_the_demo_is_that_of_the_page_and_runs(page: str) -> None:
    said = re.findall(r'^say "    (.*)"$', text_of(ROOT / "script" / "demo"), flags=re.MULTILINE)
    activate, first = said
    shown = text_of(ROOT / page)
    assert f"    {activate}" in shown
    assert f"    {first}\n" in shown
    command, *arguments = shlex.split(first)
    assert command == "ehsid"
    done = subprocess.run(
        [sys.executable, "-m", "ehsid", *arguments], cwd=ROOT, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
