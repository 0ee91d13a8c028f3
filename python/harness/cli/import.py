# SPDX-License-Identifier: MIT
"""`ehsid import`: makes a record of a log, and says what was taken for what."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .console import Console
from .importing import imported, print_record
from .options import AsJson, Maps, RecordFile, SamplingTime

if TYPE_CHECKING:
    from ..records import Record


def _summary(record: Record) -> dict[str, Any]:
    return {
        "record": record.name,
        "samples": len(record),
        "dt_s": record.dt_s,
        "segments": len(record.segments),
        "columns": list(record.columns),
        "sha256": record.sha256,
        "reading": None if record.origin is None else record.origin.to_dict(),
    }


def import_command(
    log: RecordFile,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None, typer.Option(help="record to write (parquet, csv, csv.gz, mat, npz)")
    ] = None,
) -> None:
    r"""Read a log of any kind, say what was taken for what, and keep it as a record.

    Channels get the names and SI units of a record; other columns keep their names and numbers.
    Without --out nothing is written.

    Examples: ehsid import run.mf4 --out run.parquet

    ehsid import run.txt --map "position_m=Stroke \[mm]" --dt 0.001 --out run.parquet
    """
    record = imported(log, maps, sampling_time, out)
    if as_json:
        typer.echo(json.dumps(_summary(record), allow_nan=False))
    else:
        print_record(record, out, Console())
