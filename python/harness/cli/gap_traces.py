# SPDX-License-Identifier: MIT
"""`ehsid gap --simulated`: what a simulated trace tells, without the simulator."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..catalogue.channels import CHANNELS, COMMAND, POSITION, TIME
from ..records import Hints, Record
from ..records.record import told_apart
from ..rigs import Rig
from .console import Console, print_blocks, print_points
from .options import read_shown
from .progress import progress_of

if TYPE_CHECKING:
    from ..diagnosis.options import DiagnosisOptions
    from ..diagnosis.result import Diagnosis


def gap_of_traces(
    records: Sequence[Record],
    traces: Sequence[Path],
    rig: Rig | None,
    folder: Path,
    rig_file: str,
    options: DiagnosisOptions,
) -> Diagnosis:
    """Diagnoses records from traces, one for each in their order, and writes the results.

    Raises
    ------
    ValueError
        there is another number of traces than of records, or a trace does not belong to its record.
    """
    from ..diagnosis.traces.findings import diagnose_traces
    from ..diagnosis.traces.match import matched
    from ..show.trace_page import write_traces

    if len(traces) != len(records):
        raise ValueError(
            f"--simulated: {len(traces)} traces for {len(records)} records: expected one trace for "
            "each record, in the order of the records"
        )
    machine = _machine(records, rig)
    simulated = [
        read_shown(path, Hints(), columns=list(CHANNELS), required=(TIME, POSITION))
        for path in traces
    ]
    # A trace often has the file name of its record, in another folder.
    named = told_apart([*records, *simulated])
    pairs = zip(named[: len(records)], named[len(records) :], strict=True)
    found = [matched(record, trace, machine) for record, trace in pairs]
    with progress_of(f"comparing {machine.name} with its simulation") as progress:
        diagnosis = diagnose_traces(found, machine, exclude=options.exclude, progress=progress)
    write_traces(folder, diagnosis, named, rig_file)
    return diagnosis


def _machine(records: Sequence[Record], rig: Rig | None) -> Rig:
    """The rig as far as it is told; its simulator is not run."""
    if rig is not None:
        return rig
    largest = max(float(np.abs(one.column(COMMAND)).max()) for one in records)
    return Rig(records[0].name, "simulator", {"valve.rated_command_v": largest})


def print_traces(diagnosis: Diagnosis, folder: Path, console: Console) -> None:
    """Prints the verdict in a sentence, then what it rests on."""
    from ..show.trace_page import TITLES, trace_tables

    console.print(f"\n{TITLES[diagnosis.verdict]}", style="bold")
    console.print(diagnosis.sentence, style="bold")
    print_points(diagnosis.reasons, console)
    for table in trace_tables(diagnosis):
        console.print()
        print_blocks([table], console)
    for remark in diagnosis.remarks:
        console.print(f"{'serious' if remark.serious else 'note'}: {remark.record}: {remark.what}")
    console.print(f"\nreport: {folder / 'report.html'}", soft_wrap=True)
