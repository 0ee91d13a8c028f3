# SPDX-License-Identifier: MIT
"""Options that several commands share. Imports no library of the work, so that --help is fast.

Options of all commands that read a record; they read it here and show what was read.

The options that say where the tasks of a command run: in how many processes, or on a cluster.
"""

from __future__ import annotations

import logging
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.parallel import on_cluster
from ..base.parallel import workers as using
from .console import Console, print_blocks

if TYPE_CHECKING:
    from ..models.identification import IoData
    from ..records import Hints, Layout, Record
    from ..records.record import Origin


RECORD_HELP = "CSV, Parquet, MAT, NPZ, or any log: text, Excel, HDF5, MF4, TDMS, MCAP, ROS bag"


class SignalName(StrEnum):
    """Names of the test signals."""

    multisine = "multisine"
    prbs = "prbs"
    steps = "steps"
    chirp = "chirp"
    triangle = "triangle"


class HilLoop(StrEnum):
    """Kind of run: the published experiment, an open loop, or position control on the target."""

    experiment = "experiment"
    open = "open"
    position = "position"


RecordFile = Annotated[Path, typer.Argument(help=RECORD_HELP)]
RigOrPublished = Annotated[
    Path | None, typer.Option("--rig", help="rig file, TOML; default: the published rig")
]
InputColumn = Annotated[str, typer.Option("--input", help="input column")]
OutputColumn = Annotated[str, typer.Option("--output", help="output column")]
Offset = Annotated[
    bool,
    typer.Option(
        "--offset/--no-offset",
        help="estimate a constant term: the mean command of a record is not the command at which a "
        "servo stands still",
    ),
]
ForServo = Annotated[
    bool,
    typer.Option(
        "--servo",
        help="ServoEstimator, for K, omega_n and xi, in place of an ARX model; --setting then "
        "takes delay, drift and tolerance",
    ),
]
Reset = Annotated[
    bool, typer.Option("--reset/--no-reset", help="restart where the RMSE shows a change")
]
PastOutputs = Annotated[int, typer.Option("--na", min=1, max=6, help="past outputs")]
PastInputs = Annotated[int, typer.Option("--nb", min=1, max=6, help="past inputs")]
Delay = Annotated[int, typer.Option("--nk", min=0, max=20, help="delay in samples")]
AsJson = Annotated[bool, typer.Option("--json", help="print the result as JSON")]


LOGGER = logging.getLogger("ehsid")

Maps = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="CHANNEL=COLUMN",
        help="column of the log for a channel, with its unit: 'position_m=Stroke \\[mm]'. "
        "Again for more",
    ),
]
SamplingTime = Annotated[
    float | None,
    typer.Option(
        "--dt",
        metavar="SECONDS",
        help="sampling time, where the log has no time; else the log is resampled to it",
        show_default=False,
    ),
]


def hints_of(maps: Sequence[str] | None, dt_s: float | None) -> Hints:
    """Returns what the options say about a log.

    Raises
    ------
    ValueError
        an option cannot be read.
    """
    from ..records import NO_HINTS, Hints

    if dt_s is not None and not 0.0 < dt_s < float("inf"):
        raise ValueError(f"--dt {dt_s:g}: expected a sampling time in seconds, above 0")
    if not maps:
        return Hints(dt_s=dt_s) if dt_s is not None else NO_HINTS
    from ..records.mapping import parse_maps

    return Hints(parse_maps(maps), dt_s)


def read_shown(
    path: Path,
    hints: Hints,
    *,
    columns: Sequence[str] | None = None,
    required: Sequence[str] | None = None,
    layout: Layout | None = None,
) -> Record:
    """Reads a record, and shows on stderr what was taken for what in a log of another layout."""
    from ..records import read_record

    record = read_record(path, columns=columns, required=required, layout=layout or {}, hints=hints)
    show_read(record, path)
    return record


def show_read(record: Record, path: Path) -> None:
    """Shows on stderr what was taken for what in a log, and logs what was read."""
    if record.origin is not None:
        show_origin(record.name, record.origin, Console(stderr=True))
    log_record(record, path)


def check_signals(input_name: str, output_name: str) -> None:
    """Checks the options --input and --output.

    Raises
    ------
    ValueError
        the two options name the same column, or the time.
    """
    from ..catalogue.channels import TIME

    for option, name in (("--input", input_name), ("--output", output_name)):
        if name == TIME:
            raise ValueError(
                f"{option} {TIME}: this is the time of the samples, not a signal: expected "
                f"a column with the {option[2:]} of the plant; name one"
            )
    if input_name == output_name:
        raise ValueError(
            f"--input {input_name}, --output {output_name}: expected two columns; name the command "
            "as the input and the measured signal as the output"
        )


def read_io(
    path: Path, input_name: str, output_name: str, hints: Hints
) -> tuple[IoData, Origin | None]:
    """Reads the input column and the output column of a record.

    What was taken for what in a log of another layout is shown on stderr, and returned.

    Raises
    ------
    ValueError
        the two options name the same column, or the time; or the record has a problem.
    """
    from ..catalogue.channels import CHANNELS
    from ..models.identification import IoData
    from ..records.errors import MisnamedColumnError

    check_signals(input_name, output_name)
    try:
        record = read_shown(path, hints, columns=[input_name, output_name])
    except MisnamedColumnError as error:
        options = {input_name: "--input", output_name: "--output"}
        if error.column not in options or error.column in CHANNELS:
            raise
        name = error.nearest or "COLUMN"
        raise error.with_remedy(f"{options[error.column]} {shlex.quote(name)}") from None
    return IoData.from_record(record, input_name, output_name), record.origin


def log_record(record: Record, path: Path) -> None:
    """Logs what was read from a file."""
    step = "no time" if record.dt_s is None else f"every {record.dt_s:.6g} s"
    pieces = f" in {len(record.segments)} pieces" if len(record.segments) > 1 else ""
    columns = ", ".join(record.columns)
    LOGGER.info("%s: %d samples, %s%s: %s", path, len(record), step, pieces, columns)


def show_origin(name: str, origin: Origin, console: Console) -> None:
    """Prints the table of columns of a log, and the remarks."""
    from ..show.where_section import origin_table

    console.print(f"{name}: read as {origin.kind}", soft_wrap=True)
    if origin.taken:
        print_blocks([origin_table(origin)], console)
    for remark in origin.remarks:
        console.print(f"note: {remark}", soft_wrap=True)


Workers = Annotated[int | None, typer.Option(min=1, help="processes; default: one for each core")]
Dask = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler: tcp://HOST:PORT")
]


def check_one_place(cluster: str | None, workers: int | None) -> None:
    """Raises ValueError where both a cluster and a number of processes are given."""
    if cluster is not None and workers is not None:
        raise ValueError("--workers is of this machine: leave it away with --dask")


@contextmanager
def on(cluster: str | None, workers: int | None) -> Iterator[None]:
    """Runs the tasks of its block on a Dask cluster, or in this number of processes.

    Raises
    ------
    ValueError
        both a cluster and a number of processes are given, or the cluster cannot be used.
    """
    check_one_place(cluster, workers)
    if cluster is None:
        with using(workers):
            yield
        return
    with on_cluster(cluster):
        yield
