# SPDX-License-Identifier: MIT
"""Running a check: every case that has no result yet, several at a time, each kept at once."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ehsid.harness.gap.diagnosis_file import diagnosis_text
from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.parallel import run_unordered
from ehsid.harness.records import Record, read_record
from ehsid.harness.rigs import read_rig, write_rig
from ehsid.harness.validation.blind.seal import ANSWERS, CASES, RESULTS, Seal
from ehsid.harness.validation.jobs import (
    ERROR,
    Diagnose,
    Job,
    Outcome,
    failure,
    keep,
    run_job,
)

DIAGNOSIS = "diagnosis.json"


def unfinished_cases(out: Path) -> list[str]:
    """Names of the cases without a result, in order."""
    names = sorted(path.name for path in (out / CASES).iterdir())
    done = (DIAGNOSIS, ERROR)
    return [
        name for name in names if not any((out / RESULTS / name / one).is_file() for one in done)
    ]


def run_check(out: Path, seal: Seal, diagnose: Diagnose) -> Iterator[Outcome]:
    """Diagnose the cases without a result; each is kept before it is given.

    What runs elsewhere is handed the rig and the two records, never a path: it could not open the
    answers or the transfer records if it tried.
    """
    excluded = _truth_of(out) if seal.settings.exclude_truth else {}
    tasks = (_task(out, name, excluded.get(name, ()), diagnose) for name in unfinished_cases(out))
    return run_and_keep(tasks, out / RESULTS)


def run_and_keep(tasks: Iterable[Callable[[], Outcome]], folder: Path) -> Iterator[Outcome]:
    """Outcomes as they come, each kept in the folder before it is given."""
    for outcome in run_unordered(tasks):
        keep(outcome, folder)
        yield outcome


def _truth_of(out: Path) -> Mapping[str, tuple[str, ...]]:
    """Effects of each case: for the study that leaves the true one out, and for nothing else."""
    answers = json.loads((out / ANSWERS).read_text(encoding="utf-8"))
    return {name: tuple(answer["effects"]) for name, answer in answers.items()}


def _task(
    out: Path, name: str, exclude: tuple[str, ...], diagnose: Diagnose
) -> Callable[[], Outcome]:
    try:
        job = read_case(out, name, exclude)
    except Exception as error:  # an iterable of tasks must not raise
        return functools.partial(Outcome, name, *failure(error), 0.0)
    return functools.partial(run_job, job, diagnose, write_brief)


def read_case(out: Path, name: str, exclude: tuple[str, ...] = ()) -> Job:
    """What is told of a case; files go by their path below the check's folder."""
    folder = out / CASES / name
    rig = read_rig(folder / "rig.toml")
    train, validate = (
        replace(read_record(path, layout=rig.columns), source=path.relative_to(out))
        for path in (folder / "train.csv", folder / "validate.csv")
    )
    return Job(name, rig, f"{CASES}/{name}/rig.toml", (train,), (validate,), exclude)


def write_brief(
    folder: Path, diagnosis: Diagnosis, records: Sequence[Record], rig_file: str
) -> None:
    """What scoring reads: `diagnosis.json` and the rig with what was found."""
    text = diagnosis_text(diagnosis, records, rig_file)
    (folder / DIAGNOSIS).write_text(text, encoding="utf-8")
    write_rig(diagnosis.augmented_rig, folder / "rig.augmented.toml")
