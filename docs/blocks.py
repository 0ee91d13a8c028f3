# SPDX-License-Identifier: MIT
"""Runs the code blocks of a page in their order, and writes what they print into the page.

- A block of `python` runs in one interpreter for the whole page; a block of `sh` runs in bash,
  where `ehsid` is the command of this package. Both stop at the first error.
- A block of any language whose first line is a comment "file: NAME" is written to that file.
- A block of `text` directly below a block of `python` or `sh` holds what that block prints. A line
  "..." in it stands for lines that are left out: each part between such lines is found again by its
  first line, whatever its numbers are.
- All other blocks are for reading only.
"""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
import tempfile
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Any

BLOCK = re.compile(
    r"^```(?P<language>\w+)\n(?P<code>.*?)^```\n(?:\n^```text\n(?P<shown>.*?)^```\n)?",
    re.DOTALL | re.MULTILINE,
)
FILE = re.compile(r"\W*file: (?P<name>[\w./]+)")
LEFT_OUT = "..."
NUMBER = re.compile(r"-?\d[\d.,]*(e[+-]?\d+)?")
# Columns of the terminal that the commands see.
COLUMNS = "80"


def run(page: str) -> tuple[str, dict[str, Any]]:
    """Runs the page in a new folder; returns it with what was printed, and its Python names."""
    with tempfile.TemporaryDirectory() as folder:
        return run_in(Path(folder), page)


def run_in(folder: Path, page: str) -> tuple[str, dict[str, Any]]:
    """Runs the page in a folder that exists; returns the same as `run`."""
    names: dict[str, Any] = {}

    def printed(block: re.Match[str]) -> str:
        language, code, shown = block["language"], block["code"], block["shown"]
        named = FILE.match(code.split("\n", 1)[0])
        if named:
            file = Path(named["name"])
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(code, encoding="utf-8")
            return block[0]
        if language == "python":
            output = _python(code, names)
        elif language == "sh":
            output = _shell(code)
        else:
            return block[0]
        text = f"```{language}\n{code}```\n"
        return text if shown is None else f"{text}\n```text\n{_like(shown, output)}```\n"

    with chdir(folder):
        return BLOCK.sub(printed, page), names


def _python(code: str, names: dict[str, Any]) -> str:
    out = io.StringIO()
    with redirect_stdout(out):
        exec(compile(code, "page", "exec"), names)
    return out.getvalue()


def _shell(code: str) -> str:
    with tempfile.TemporaryDirectory() as commands:
        command = Path(commands) / "ehsid"
        command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m ehsid "$@"\n', encoding="utf-8")
        command.chmod(0o755)
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", code],
            env={
                **os.environ,
                "COLUMNS": COLUMNS,
                "PATH": os.pathsep.join([commands, os.environ["PATH"]]),
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            check=False,
        )
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode} of\n{code}\n{done.stdout}")
    return done.stdout


def _like(shown: str, output: str) -> str:
    """Returns the lines of an output of which the page shows others, older ones."""
    # A space that keeps a number and its unit together cannot be seen on a page.
    text = output.replace("\N{NO-BREAK SPACE}", " ")
    lines = [line.rstrip() for line in text.splitlines()]
    before = shown.splitlines()
    if LEFT_OUT not in before:
        return "".join(f"{line}\n" for line in lines)
    kept, at, looking = [], 0, False
    for line in before:
        if line == LEFT_OUT:
            looking = True
            kept.append(LEFT_OUT)
            continue
        at = _found(line, lines, at) if looking else at
        looking = False
        kept.extend(lines[at : at + 1])
        at += 1
    return "".join(f"{line}\n" for line in kept)


def _found(line: str, lines: list[str], begin: int) -> int:
    """Returns where a line stands, whatever its numbers are."""
    for at in range(begin, len(lines)):
        if _without_numbers(lines[at]) == _without_numbers(line):
            return at
    raise ValueError("the output has no line like\n{}\nIt is\n{}".format(line, "\n".join(lines)))


def _without_numbers(line: str) -> str:
    return re.sub(r"[\s━─]+", " ", NUMBER.sub("#", line))
