# SPDX-License-Identifier: MIT
"""`ehsid import`: makes a record of a log, and says what was taken for what."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..base.files import result_files
from .console import Console
from .options import AsJson, Maps, RecordFile, SamplingTime, hints_of, show_origin

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


def _print(record: Record, out: Path | None, console: Console) -> None:
    if record.origin is None:
        console.print(f"{record.name} follows the schema of records: nothing had to be changed")
    else:
        show_origin(record.name, record.origin, console)
    step = "no time" if record.dt_s is None else f"every {record.dt_s:.6g} s"
    pieces = f", in {len(record.segments)} pieces" if len(record.segments) > 1 else ""
    console.print(f"{len(record)} samples, {step}{pieces}: {', '.join(record.columns)}")
    block = "" if record.origin is None else record.origin.columns_block()
    if block:
        console.print("\nThis block in a rig file, or --map for each column, reads it again so:\n")
        console.print(block, soft_wrap=True)
    if out is not None:
        console.print(f"record: {out}", soft_wrap=True)


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
    from ..records import read_record
    from ..records.record import format_of, record_bytes

    placing: AbstractContextManager[Path | None] = nullcontext()
    if out is not None:
        format_of(out)
        placing = result_files(out, "import", inputs=[log])
    with placing as folder:
        record = read_record(log, required=(), hints=hints_of(maps, sampling_time))
        if out is not None and folder is not None:
            (folder / out.name).write_bytes(record_bytes(record, out.name))
    if as_json:
        typer.echo(json.dumps(_summary(record), allow_nan=False))
    else:
        _print(record, out, Console())
