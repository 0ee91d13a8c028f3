# SPDX-License-Identifier: MIT
"""A bad input, what it is given to, and what must come of it."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

# The content of a file, or a function that makes it or puts something else at its path.
Content = str | bytes | Callable[[Path], None]


@dataclass(frozen=True)
class Outcome:
    """What a bad input gets."""

    kind: str
    """"exit code 2", or the name of an exception or of a status."""
    message: str
    """What the user reads."""


@dataclass(frozen=True)
class Case:
    """A bad input."""

    wrong: str
    """What is wrong with it, for people; also its name in the test."""
    call: str
    """The command or the call, as a user would write it."""
    run: Callable[[], Outcome]
    """Gives it to ehsid; its files are in the current folder."""
    kind: str
    """`Outcome.kind` that is expected."""
    files: Mapping[str, Content]
    """Files that are in the folder before, by name."""
    library: str | None = None
    """Regular expression of the words in the message that come from a library; the document shows
    "..." there, because they differ among its versions."""
    writes: tuple[str, ...] = ()
    """Names of files and folders that it may make: of the report that says what is wrong. All
    others stay as they are."""

    def make(self, folder: Path) -> None:
        """Makes the files in the folder."""
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, str):
                path.write_text(content, encoding="utf-8", newline="")
            elif isinstance(content, bytes):
                path.write_bytes(content)
            else:
                content(path)

    def outcome(self, folder: Path) -> Outcome:
        """Gives the input to ehsid in a folder with its files."""
        with working_in(folder):
            return self.run()


@contextmanager
def working_in(folder: Path) -> Iterator[None]:
    """Makes the folder the current one, so that messages have short paths."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def command(
    wrong: str,
    line: str,
    *,
    files: Mapping[str, Content] | None = None,
    environment: Mapping[str, str] | None = None,
    library: str | None = None,
    writes: tuple[str, ...] = (),
) -> Case:
    """A line of a shell that starts with `ehsid`, which must end with exit code 2."""
    settings = environment or {}
    shown = " ".join([*(f"{name}={value}" for name, value in settings.items()), line])
    return Case(
        wrong,
        shown,
        lambda: _run(line, settings),
        "exit code 2",
        files or {},
        library,
        writes,
    )


def _run(line: str, settings: Mapping[str, str]) -> Outcome:
    from typer.testing import CliRunner

    from ehsid.harness.cli import cli

    program, *arguments = shlex.split(line)
    assert program == "ehsid"
    # The width of a terminal in which no message is broken into lines.
    ended = CliRunner().invoke(cli, arguments, env={"COLUMNS": "4000", **settings})
    if ended.exception is not None and not isinstance(ended.exception, SystemExit):
        raise ended.exception
    assert "Traceback" not in ended.output
    return Outcome(f"exit code {ended.exit_code}", message_of(ended.stderr))


def message_of(stderr: str) -> str:
    """What a command has printed on stderr, without the name of the program in front."""
    return re.sub(r"^ehsid: ", "", stderr.strip(), flags=re.MULTILINE)
