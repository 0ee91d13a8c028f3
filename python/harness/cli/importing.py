# SPDX-License-Identifier: MIT
"""Makes a record of a log for a command, and shows what was taken for what."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.files import result_files
from .console import Console
from .options import hints_of, show_origin

if TYPE_CHECKING:
    from ..records import Record


def imported(
    log: Path,
    maps: Sequence[str] | None,
    sampling_time: float | None,
    out: Path | None,
    required: Sequence[str] = (),
) -> Record:
    """Reads a log, and writes it as a record where `out` names one.

    Parameters
    ----------
    log, maps, sampling_time, out
        those of the command.
    required
        columns without which nothing is written.

    Raises
    ------
    ValueError
        an option cannot be read, or the log cannot be read with these columns.
    """
    from ..records import read_record
    from ..records.record import format_of, record_bytes

    placing: AbstractContextManager[Path | None] = nullcontext()
    if out is not None:
        format_of(out)
        placing = result_files(out, "import", inputs=[log])
    with placing as folder:
        record = read_record(log, required=required, hints=hints_of(maps, sampling_time))
        if out is not None and folder is not None:
            (folder / out.name).write_bytes(record_bytes(record, out.name))
    return record


def print_record(record: Record, out: Path | None, console: Console) -> None:
    """Prints what was taken for what, and what the record has."""
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
