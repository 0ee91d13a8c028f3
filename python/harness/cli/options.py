# SPDX-License-Identifier: MIT
"""Options that several commands share. Imports no library of the work, so that --help is fast."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

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
RigFile = Annotated[Path, typer.Option("--rig", help="rig file, TOML")]
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
Reset = Annotated[
    bool, typer.Option("--reset/--no-reset", help="restart where the RMSE shows a change")
]
PastOutputs = Annotated[int, typer.Option("--na", min=1, max=6, help="past outputs")]
PastInputs = Annotated[int, typer.Option("--nb", min=1, max=6, help="past inputs")]
Delay = Annotated[int, typer.Option("--nk", min=0, max=20, help="delay in samples")]
AsJson = Annotated[bool, typer.Option("--json", help="print the result as JSON")]
