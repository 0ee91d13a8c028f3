# SPDX-License-Identifier: MIT
"""Writes the files of a diagnosis; all are complete before the first one is put in its place."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import polars as pl

from ehsid.harness.gap.diagnosis_file import NEXT_EXPERIMENT, diagnosis_text
from ehsid.harness.gap.schema import Diagnosis, HeldOutRun
from ehsid.harness.records import Record, write_record
from ehsid.harness.report.gap_page import RecordLine, render_diagnosis
from ehsid.harness.rigs import write_rig

FILES = ("diagnosis.json", "simulation.csv", "rig.augmented.toml", NEXT_EXPERIMENT, "report.html")

# Significant digits in simulation.csv: they show a hundredth of the resolution of a 24-bit sensor.
DIGITS = 9


def write_diagnosis(
    folder: Path, diagnosis: Diagnosis, records: Sequence[Record], rig_file: str
) -> list[Path]:
    """Writes `FILES` into a folder; `next_experiment.csv` only if there is a next experiment.

    Parameters
    ----------
    folder
        is made if it does not exist; files of an earlier diagnosis are replaced.
    diagnosis
        the findings to write.
    records
        all records that the diagnosis used, as they were read.
    rig_file
        path of the rig file, as the user gave it.

    Returns
    -------
    Paths of the files that were written.

    Raises
    ------
    OSError
        the file system refuses to write; an error while the files are prepared leaves the files
        of an earlier diagnosis unchanged.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with _unfinished(folder) as unfinished:
        text = diagnosis_text(diagnosis, records, rig_file)
        (unfinished / "diagnosis.json").write_text(text, encoding="utf-8")
        simulation_table(diagnosis.runs).write_csv(unfinished / "simulation.csv")
        write_rig(diagnosis.augmented_rig, unfinished / "rig.augmented.toml")
        if diagnosis.next_experiment is not None:
            write_record(diagnosis.next_experiment.record, unfinished / NEXT_EXPERIMENT)
        lines = [
            RecordLine(
                record.name,
                diagnosis.records.get(record.name, ""),
                str(record.source or record.name),
                record.sha256 or "",
            )
            for record in records
        ]
        page = render_diagnosis(diagnosis, lines, rig_file)
        (unfinished / "report.html").write_text(page, encoding="utf-8")
        made = [name for name in FILES if (unfinished / name).exists()]
        for name in made:
            (unfinished / name).replace(folder / name)
        for name in set(FILES) - set(made):
            (folder / name).unlink(missing_ok=True)
    return [folder / name for name in made]


@contextmanager
def _unfinished(folder: Path) -> Iterator[Path]:
    """Yields a temporary folder on the file system of the finished files, and removes it after."""
    made = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)
        with suppress(OSError):  # rmdir removes the folder only if nothing was written into it
            folder.rmdir()


def simulation_table(runs: Sequence[HeldOutRun]) -> pl.DataFrame:
    """Returns the held-out samples inside windows with their simulations, one row for each sample.

    The columns are `record`, `time_s`, `window`, and for each output `OUTPUT_measured`,
    `_nominal`, `_calibrated` and `_augmented`. Cells are empty where a record lacks the output.
    Numbers have nine significant digits.
    """
    names = list(dict.fromkeys(name for run in runs for name in run.measured))
    parts = [_part(run, names) for run in runs]
    if not parts:
        return pl.DataFrame(schema={"record": pl.String, "time_s": pl.Float64, "window": pl.Int64})
    return pl.concat(parts).with_columns(pl.selectors.float().fill_nan(None).round_sig_figs(DIGITS))


def _part(run: HeldOutRun, names: Sequence[str]) -> pl.DataFrame:
    inside = run.window >= 0
    kinds = {
        "measured": run.measured,
        "nominal": run.nominal,
        "calibrated": run.calibrated,
        "augmented": run.augmented,
    }
    empty = np.full(run.time_s.size, np.nan)
    columns = {
        f"{name}_{kind}": values.get(name, empty)[inside]
        for name in names
        for kind, values in kinds.items()
    }
    return pl.DataFrame(
        {
            "record": [run.record] * int(inside.sum()),
            "time_s": run.time_s[inside],
            "window": run.window[inside],
            **columns,
        }
    )
