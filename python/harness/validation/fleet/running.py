# SPDX-License-Identifier: MIT
"""Run of a fleet: which machines of a folder need a diagnosis, and the diagnosis of each."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import ehsid
from ehsid.harness.files import is_incomplete
from ehsid.harness.manifest import sha256_of
from ehsid.harness.records import NO_HINTS, Hints
from ehsid.harness.records.formats import FOLDER_ENDINGS, records_in
from ehsid.harness.validation.blind.running import DIAGNOSIS, run_and_keep
from ehsid.harness.validation.jobs import (
    ERROR,
    RESULT,
    Diagnose,
    Job,
    Outcome,
    Write,
    failure,
    keep,
    one_line,
    run_job,
)

RIG = "rig.toml"
INPUTS = "inputs.json"
HELD_OUT = "validate"

# Reads the folder of a machine; raises a ValueError or OSError with a message where it cannot.
Read = Callable[[Path], Job]


def machine_folders(folder: Path) -> list[Path]:
    """Returns the sub-folders by name, one for each machine; hidden ones are left out.

    Raises
    ------
    ValueError
        there is no such folder, or it has no sub-folder.
    """
    if not folder.is_dir():
        raise ValueError(
            f"{folder}: there is no such folder: expected one with a sub-folder for each machine"
        )
    machines = sorted(
        path for path in folder.iterdir() if path.is_dir() and not path.name.startswith(".")
    )
    if not machines:
        raise ValueError(f"{folder}: has no sub-folders; expected one for each machine, with {RIG}")
    return machines


def record_files(folder: Path) -> tuple[list[Path], list[Path]]:
    """Returns the records of a machine to fit, and the held-out ones, both sorted by name.

    Raises
    ------
    ValueError
        there is no rig file, or no record to fit.
    """
    if not (folder / RIG).is_file():
        raise ValueError(f"{folder}: has no {RIG}: expected it beside the records")
    records = records_in(folder)
    held_out = [path for path in records if path.name.lower().startswith(HELD_OUT)]
    fitted = [path for path in records if path not in held_out]
    if not fitted:
        also = f" beside those that start with '{HELD_OUT}' and are held out" if held_out else ""
        endings = ", ".join(f".{ending}" for ending in FOLDER_ENDINGS)
        raise ValueError(f"{folder}: has no record{also}: expected at least one ({endings})")
    return fitted, held_out


def inputs_of(folder: Path, exclude: Sequence[str], hints: Hints = NO_HINTS) -> bytes:
    """Returns what determines a result, as JSON: digests of files, options, version."""
    files = {path.name: sha256_of(path) for path in sorted(folder.iterdir()) if path.is_file()}
    maps = {channel: [column.name, column.unit] for channel, column in hints.maps.items()}
    plain = {
        "files": files,
        "exclude": list(exclude),
        "map": maps,
        "dt_s": hints.dt_s,
        "ehsid_version": ehsid.__version__,
    }
    return (json.dumps(plain, indent=1) + "\n").encode()


def is_finished(result: Path, inputs: Callable[[], bytes]) -> bool:
    """Whether the folder of a result has a diagnosis of the same inputs.

    The inputs are only asked for where there is a diagnosis: to read all files of a large fleet
    takes minutes.
    """
    kept = result / INPUTS
    there = (result / DIAGNOSIS).is_file() and kept.is_file() and kept.read_bytes() == inputs()
    return there and not is_incomplete(result, RESULT)


def unfinished_machines(
    folders: Iterable[Path], out: Path, exclude: Sequence[str], hints: Hints = NO_HINTS
) -> list[Path]:
    """Returns the machines without a diagnosis of their present files; errors are tried again.

    A machine whose files cannot be read is among them: its diagnosis then says why.
    """

    def finished(folder: Path) -> bool:
        try:
            inputs = functools.partial(inputs_of, folder, exclude, hints)
            return is_finished(out / folder.name, inputs)
        except OSError:
            return False

    return [folder for folder in folders if not finished(folder)]


def run_fleet(
    folders: Sequence[Path],
    out: Path,
    exclude: Sequence[str],
    read: Read,
    diagnose: Diagnose,
    write: Write,
    hints: Hints = NO_HINTS,
) -> Iterator[Outcome]:
    """Diagnoses each machine; the files of `write` are in OUT/NAME before an outcome is yielded.

    `hints` are what `read` was told about the records; they belong to the inputs of a result.

    A machine whose process is killed, for example for want of memory, gets an error; the others go
    on. Which of those at work it was shows when they are run again, half of them at a time.
    """
    left = {folder.name: folder for folder in folders}
    tasks = (_task(folder, exclude, read, diagnose, write, hints) for folder in folders)
    try:
        for outcome in run_and_keep(tasks, out):
            del left[outcome.name]
            yield outcome
    except ChildProcessError:
        again = list(left.values())
        if len(again) == 1:
            message = (
                f"{again[0]}: its process was killed, perhaps for want of memory: take shorter "
                "records or fewer --workers"
            )
            killed = Outcome(again[0].name, {ERROR: f"{message}\n".encode()}, message, 0.0)
            keep(killed, out)
            yield killed
            return
        for some in (again[: len(again) // 2], again[len(again) // 2 :]):
            yield from run_fleet(some, out, exclude, read, diagnose, write, hints)


def _task(
    folder: Path,
    exclude: Sequence[str],
    read: Read,
    diagnose: Diagnose,
    write: Write,
    hints: Hints,
) -> Callable[[], Outcome]:
    try:
        job = replace(read(folder), exclude=tuple(exclude))
        inputs = inputs_of(folder, exclude, hints)
        return functools.partial(run_machine, job, diagnose, write, inputs)
    except (ValueError, OSError) as error:
        message = one_line(str(error))
        files = {ERROR: f"{message}\n".encode()}
    except Exception as error:  # whatever a machine has, it does not end the others
        files, message = failure(error)
    return functools.partial(Outcome, folder.name, files, message, 0.0)


def run_machine(job: Job, diagnose: Diagnose, write: Write, inputs: bytes) -> Outcome:
    """Diagnoses one machine and adds a file of the inputs to the files of the result."""
    outcome = run_job(job, diagnose, write)
    return replace(outcome, files=outcome.files | {INPUTS: inputs})
