# SPDX-License-Identifier: MIT
"""One diagnosis as a task: data in, files out, so that it may run on another machine."""

from __future__ import annotations

import shutil
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.parallel import workers
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig

ERROR = "error.txt"

# `ehsid.harness.gap.diagnose`, or what stands in for it.
Diagnose = Callable[..., Diagnosis]
# Writes the files of a diagnosis into a folder: folder, diagnosis, records, rig file.
Write = Callable[[Path, Diagnosis, Sequence[Record], str], object]


@dataclass(frozen=True)
class Job:
    """All that a diagnosis may know.

    Attributes
    ----------
    name
        of the case or the machine.
    rig
        as told; `rig_file` as it stands in the results.
    fitted, held_out
        records.
    exclude
        ids of effects that are not to be found.
    """

    name: str
    rig: Rig
    rig_file: str
    fitted: tuple[Record, ...]
    held_out: tuple[Record, ...]
    exclude: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """What came of it.

    Attributes
    ----------
    name
        of the job.
    files
        contents by name; `ERROR` alone where the diagnosis raised.
    word
        the verdict, or the last line of the error.
    seconds
        it took.
    """

    name: str
    files: dict[str, bytes]
    word: str
    seconds: float

    @property
    def failed(self) -> bool:
        """The diagnosis raised."""
        return ERROR in self.files


def run_job(job: Job, diagnose: Diagnose, write: Write) -> Outcome:
    """Diagnose on one core; an error is an outcome, too."""
    began = time.monotonic()
    try:
        with workers(1):
            found = diagnose(
                list(job.fitted), job.rig, validate=list(job.held_out), exclude=job.exclude
            )
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder), found, (*job.fitted, *job.held_out), job.rig_file)
            files = {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}
        word: str = found.verdict
    except Exception as error:
        files, word = failure(error)
    return Outcome(job.name, files, word, time.monotonic() - began)


def failure(error: Exception) -> tuple[dict[str, bytes], str]:
    """File of an error, whose last line is its message, and that message."""
    message = one_line(f"{type(error).__name__}: {error}")
    text = "".join(traceback.format_exception(error))
    return {ERROR: f"{text}\n{message}\n".encode()}, message


def one_line(text: str) -> str:
    """Without breaks, for a log or a cell of a table."""
    return " ".join(text.split())


def keep(outcome: Outcome, folder: Path) -> None:
    """Write the files as folder/NAME; whole or not at all, in place of an earlier result."""
    unfinished = folder / ".unfinished"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    for name, content in outcome.files.items():
        (unfinished / name).write_bytes(content)
    shutil.rmtree(folder / outcome.name, ignore_errors=True)
    unfinished.rename(folder / outcome.name)
