# SPDX-License-Identifier: MIT
"""Run of a check: diagnoses each case that has no result yet and writes each result at once."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ehsid.harness.base.files import is_incomplete
from ehsid.harness.diagnosis.job import (
    DIAGNOSIS,
    ERROR,
    RESULT,
    Diagnose,
    Job,
    Outcome,
    failure,
    run_and_keep,
    run_job,
)
from ehsid.harness.diagnosis.options import DEFAULTS, DiagnosisOptions
from ehsid.harness.diagnosis.result import Diagnosis, diagnosis_text
from ehsid.harness.records import Record, read_record
from ehsid.harness.rigs import read_rig, write_rig

from .making import ANSWERS, CASES, RESULTS, Seal, read_answers


def unfinished_cases(out: Path) -> list[str]:
    """Returns the names of the cases without a result, in alphabetic order."""
    names = sorted(path.name for path in (out / CASES).iterdir())
    return [name for name in names if not _is_finished(out / RESULTS / name)]


def _is_finished(result: Path) -> bool:
    has_result = any((result / name).is_file() for name in (DIAGNOSIS, ERROR))
    return has_result and not is_incomplete(result, RESULT)


def run_check(out: Path, seal: Seal, diagnose: Diagnose) -> Iterator[Outcome]:
    """Diagnoses the cases without a result; each outcome is written before it is yielded.

    A task in another process gets the rig and the two records, but no path of the check. So it
    cannot open the answers or the transfer records.
    """
    options = _without_truth(out) if seal.settings.exclude_truth else {}
    tasks = (
        _task(out, name, options.get(name, DEFAULTS), diagnose) for name in unfinished_cases(out)
    )
    return run_and_keep(tasks, out / RESULTS)


def _without_truth(out: Path) -> Mapping[str, DiagnosisOptions]:
    """Returns options that leave out the true effects of each case, for that study alone."""
    return {
        name: DiagnosisOptions(tuple(answer.effects))
        for name, answer in read_answers(out / ANSWERS).items()
    }


def _task(
    out: Path, name: str, options: DiagnosisOptions, diagnose: Diagnose
) -> Callable[[], Outcome]:
    try:
        job = read_case(out, name, options)
    except Exception as error:  # `run_unordered` demands that the iterable of tasks does not raise
        return functools.partial(Outcome, name, *failure(error), 0.0)
    return functools.partial(run_job, job, diagnose, write_scored_files)


def read_case(out: Path, name: str, options: DiagnosisOptions = DEFAULTS) -> Job:
    """Reads what the diagnosis may know of a case; paths of files are below the check's folder."""
    folder = out / CASES / name
    rig = read_rig(folder / "rig.toml")
    train, validate = (
        replace(read_record(path, layout=rig.columns), source=path.relative_to(out))
        for path in (folder / "train.csv", folder / "validate.csv")
    )
    return Job(name, rig, f"{CASES}/{name}/rig.toml", (train,), (validate,), options)


def write_scored_files(
    folder: Path, diagnosis: Diagnosis, records: Sequence[Record], rig_file: str
) -> None:
    """Writes the files that scoring reads: `diagnosis.json` and the augmented rig file."""
    text = diagnosis_text(diagnosis, records, rig_file)
    (folder / DIAGNOSIS).write_text(text, encoding="utf-8")
    write_rig(diagnosis.augmented_rig, folder / "rig.augmented.toml")
