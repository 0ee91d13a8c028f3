# SPDX-License-Identifier: MIT
"""Runs one command of ehsid in this process, and checks what holds for every input.

The command ends with exit code 0 or 2 and says something; there is no traceback and no warning of a
library; a command that fails leaves no file; no file is left half-written; it ends in time.
"""

from __future__ import annotations

import base64
import json
import os
import signal
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any
from unittest import mock

from typer.testing import CliRunner

from ehsid.harness.cli import cli

# For one command; those that are run here take less than one second. Who waits for input that never
# comes computes nothing, and on a busy machine a command may wait for its turn.
COMPUTING_S, WAITING_S = 60.0, 600.0
SUCCESS, REFUSED = 0, 2


class Finding(Exception):  # noqa: N818 -- a command that did what it must not, not an error here
    """What did not hold, in words, with the end of the command's output."""


class _Overdue(BaseException):
    """Not an Exception: commands turn many of these into messages."""


@dataclass(frozen=True)
class Example:
    """A command and the files that it reads."""

    arguments: Sequence[str]
    """Arguments of `ehsid`; files are named relative to the folder in which it runs."""
    files: Mapping[str, bytes]
    """Content of each file by name."""

    def to_json(self) -> str:
        """The example as JSON, with the files in base 64."""
        coded = {name: base64.b64encode(data).decode() for name, data in self.files.items()}
        return json.dumps({"arguments": list(self.arguments), "files": coded}, indent=1) + "\n"

    @staticmethod
    def from_json(text: str) -> Example:
        """Reads what `to_json` has written."""
        plain = json.loads(text)
        files = {name: base64.b64decode(data) for name, data in plain["files"].items()}
        return Example(plain["arguments"], files)


def _without_diagnosis(*_: Any, **__: Any) -> None:
    raise ValueError("the input was read; the diagnosis is not run here")


@contextmanager
def _in_time() -> Iterator[None]:
    def end(_signal: int, _frame: FrameType | None) -> None:
        raise _Overdue

    limits = {
        signal.SIGPROF: (signal.ITIMER_PROF, COMPUTING_S),
        signal.SIGALRM: (signal.ITIMER_REAL, WAITING_S),
    }
    before = {number: signal.signal(number, end) for number in limits}
    for timer, seconds in limits.values():
        signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        for timer, _ in limits.values():
            signal.setitimer(timer, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)


def check(example: Example) -> str:
    """Runs the command in a folder of its own; returns what it printed.

    A diagnosis takes half a minute, so it is replaced by a refusal: `gap` is run up to the place
    where all its input has been read. Pictures are written with nothing drawn on them.

    Raises
    ------
    Finding
        something did not hold.
    """
    before = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="ehsid-fuzz-") as name:
        folder = Path(name)
        for file, data in example.files.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_bytes(data)
        os.chdir(folder)
        try:
            return _check_here(example, folder)
        finally:
            os.chdir(before)


def _check_here(example: Example, folder: Path) -> str:
    given = _files(folder)
    try:
        with (
            _in_time(),
            mock.patch("ehsid.harness.diagnosis.diagnose", _without_diagnosis),
            mock.patch("matplotlib.figure.Figure.draw"),
            warnings.catch_warnings(record=True) as warned,
        ):
            warnings.simplefilter("always")
            outcome = CliRunner().invoke(cli, list(example.arguments))
    except _Overdue:
        raise Finding(f"it had not ended after {COMPUTING_S:g} s of computing") from None
    end = outcome.output[-500:]
    if outcome.exception is not None and not isinstance(outcome.exception, SystemExit):
        what = f"{type(outcome.exception).__name__}: {outcome.exception}"
        raise Finding(f"traceback: {what}") from outcome.exception
    if outcome.exit_code not in (SUCCESS, REFUSED):
        raise Finding(f"exit code {outcome.exit_code}: {end}")
    if not outcome.output.strip():
        raise Finding(f"exit code {outcome.exit_code} without a word")
    if "Traceback (most recent call last)" in outcome.output:
        raise Finding(f"a traceback was printed: {end}")
    if warned:
        raise Finding(f"a warning of a library: {warned[0].message}")
    left = _files(folder)
    if parts := [file for file in left if file.endswith(".part")]:
        raise Finding(f"half-written: {parts}")
    if outcome.exit_code == REFUSED and left != given:
        raise Finding(f"refused, but left {sorted(left - given) or 'other inputs'}: {end}")
    return outcome.output


def _files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}
