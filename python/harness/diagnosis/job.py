# SPDX-License-Identifier: MIT
"""A diagnosis as a task: it takes data and returns files, so it may run on another machine."""

from __future__ import annotations

import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..base.error_words import error_words, fault_words
from ..base.files import FULL, result_folder, temporary_folder
from ..base.parallel import run_unordered, workers
from ..records import Record
from ..rigs import Rig
from .options import DEFAULTS, DiagnosisOptions
from .result import Diagnosis

DIAGNOSIS = "diagnosis.json"
ERROR = "error.txt"
# Name of the result of a diagnosis in its folder: that of `ehsid gap`.
RESULT = "gap"

# `ehsid.harness.diagnosis.diagnose`, or a function that replaces it.
Diagnose = Callable[..., Diagnosis]
# Writes the files of a diagnosis. Arguments: folder, diagnosis, records, rig file.
Write = Callable[[Path, Diagnosis, Sequence[Record], str], object]


@dataclass(frozen=True)
class Job:
    """Everything that a diagnosis may know.

    Attributes
    ----------
    name
        name of the case or the machine.
    rig
        the rig as configured; `rig_file` is the path that the results name.
    fitted, held_out
        records to fit, and held-out records.
    options
        the options of the diagnosis.
    """

    name: str
    rig: Rig
    rig_file: str
    fitted: tuple[Record, ...]
    held_out: tuple[Record, ...]
    options: DiagnosisOptions = DEFAULTS


@dataclass(frozen=True)
class Outcome:
    """Result of a job.

    Attributes
    ----------
    name
        name of the job.
    files
        contents of the files by name; only `ERROR` where the diagnosis raised an exception.
    word
        the verdict, or the last line of the error.
    seconds
        time that the job took, s.
    said
        what was to be shown on stderr meanwhile, such as what was taken for what in a log.
    """

    name: str
    files: dict[str, bytes]
    word: str
    seconds: float
    said: str = ""

    @property
    def failed(self) -> bool:
        """Whether the diagnosis raised an exception."""
        return ERROR in self.files


def run_job(job: Job, diagnose: Diagnose, write: Write) -> Outcome:
    """Runs the diagnosis on one core; an exception becomes an outcome, too.

    Raises
    ------
    ValueError
        the disk of temporary files is full: this says nothing about the job.
    """
    began = time.monotonic()
    try:
        with workers(1):
            found = diagnose(
                list(job.fitted), job.rig, validate=list(job.held_out), options=job.options
            )
        with temporary_folder() as folder:
            write(folder, found, (*job.fitted, *job.held_out), job.rig_file)
            files = {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
        word: str = found.verdict
    except Exception as error:
        check_room(error)
        files, word = failure(error)
    return Outcome(job.name, files, word, time.monotonic() - began)


def check_room(error: Exception) -> None:
    """Checks that an error does not only say that there is no room for temporary files.

    Raises
    ------
    ValueError
        it does.
    """
    if isinstance(error, OSError) and error.errno in FULL:
        raise ValueError(
            f"{tempfile.gettempdir()}: cannot be written to ({error.strerror}); make room "
            "there, or let TMPDIR name another folder"
        ) from None


def failure(error: Exception) -> tuple[dict[str, bytes], str]:
    """Returns the file of an exception, whose last line is its message, and that message."""
    message = one_line(f"{type(error).__name__}: {error}")
    if error_words(error) is None:
        message = fault_words(error)
    text = "".join(traceback.format_exception(error))
    return {ERROR: f"{text}\n{message}\n".encode()}, message


def one_line(text: str) -> str:
    """Returns the text without line breaks, for a log or a cell of a table."""
    return " ".join(text.split())


def keep(outcome: Outcome, folder: Path) -> None:
    """Writes the files to folder/NAME, all or none; they replace an earlier result.

    Raises
    ------
    ValueError
        as `result_folder`: a file that is not of an earlier result is in the way.
    """
    with result_folder(folder / outcome.name, RESULT, list(outcome.files)) as made:
        for name, content in outcome.files.items():
            (made / name).write_bytes(content)


def run_and_keep(tasks: Iterable[Callable[[], Outcome]], folder: Path) -> Iterator[Outcome]:
    """Runs the tasks and yields each outcome as it comes, after writing it into the folder."""
    for outcome in run_unordered(tasks):
        keep(outcome, folder)
        yield outcome
