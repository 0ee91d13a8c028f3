# SPDX-License-Identifier: MIT
"""Writes the files of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl

from ..base.files import write_text
from ..diagnosis.result import Diagnosis, HeldOutRun, diagnosis_text
from ..diagnosis.schema import NEXT_EXPERIMENT
from ..records import Record
from ..records.writing import record_bytes
from ..rigs import rig_text
from .gap_page import RecordLine, render_diagnosis

# Significant digits in simulation.csv: they show a hundredth of the resolution of a 24-bit sensor.
DIGITS = 9


def write_diagnosis(
    folder: Path, diagnosis: Diagnosis, records: Sequence[Record], rig_file: str
) -> None:
    """Writes `RESULT_FILES` into a folder; that of the next experiment only if there is one.

    Parameters
    ----------
    folder
        exists; that of `ehsid.harness.base.files.result_folder` keeps earlier results until all
        files are written.
    diagnosis
        the findings to write.
    records
        all records that the diagnosis used, as they were read.
    rig_file
        path of the rig file, as the user gave it.

    Raises
    ------
    OSError
        the file system refuses to write.
    """
    write_text(folder / "diagnosis.json", diagnosis_text(diagnosis, records, rig_file))
    write_text(folder / "simulation.csv", simulation_table(diagnosis.runs).write_csv())
    write_text(folder / "rig.augmented.toml", rig_text(diagnosis.augmented_rig))
    if diagnosis.next_record is not None:
        content = record_bytes(diagnosis.next_record, NEXT_EXPERIMENT)
        (folder / NEXT_EXPERIMENT).write_bytes(content)
    lines = [
        RecordLine(
            record.name,
            diagnosis.records.get(record.name, ""),
            str(record.source or record.name),
            record.sha256 or "",
            record.origin,
        )
        for record in records
    ]
    write_text(folder / "report.html", render_diagnosis(diagnosis, lines, rig_file))


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
