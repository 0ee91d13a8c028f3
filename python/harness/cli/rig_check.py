# SPDX-License-Identifier: MIT
"""`ehsid rig check`: says what of a rig fits a record, before anything is fitted."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.encoding import to_plain
from ..base.files import result_folder
from .console import Console, print_blocks
from .options import RECORD_HELP, AsJson, Maps, SamplingTime, hints_of, read_shown

if TYPE_CHECKING:
    from ..fitness import RecordCheck
    from ..records import Record
    from ..rigs import Rig

# More records than this have no reader.
MOST_RECORDS = 100


def _print(checks: Sequence[RecordCheck], console: Console) -> None:
    from ..show.rig_check import check_table
    from ..show.seen_words import seen_sentence

    for check in checks:
        console.print(f"{check.record}:")
        print_blocks([check_table(check.findings)], console)
        for note in check.notes:
            console.print(f"note: {note}")
        wrong = [finding.check for finding in check.findings if finding.status == "does not fit"]
        if wrong:
            console.print(f"does not fit: {', '.join(wrong)}; correct the rig, or the record")
        else:
            console.print("nothing contradicts the rig")
        if check.could_be_seen:
            console.print(
                f"at best the record can show {seen_sentence(check.could_be_seen, shown=True)}"
            )


def _checked(record: Record, rig: Rig) -> RecordCheck:
    """The check of a record, with what it can show where nothing contradicts the rig."""
    from ..diagnosis import before_any_fit
    from ..fitness import Status, check_rig

    check = check_rig(record, rig)
    if any(finding.status is Status.does_not_fit for finding in check.findings):
        return check
    return replace(check, could_be_seen=before_any_fit(record, rig))


def rig_check_command(
    rig_file: Annotated[Path, typer.Argument(metavar="RIG", help="rig file, TOML")],
    records: Annotated[list[Path], typer.Argument(metavar="RECORD...", help=RECORD_HELP)],
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None, typer.Option(help="folder for rig_check.json and a picture of each record")
    ] = None,
) -> None:
    """Say what of a rig fits records, and which value to change, before anything is fitted.

    Compares directions, stroke, commands, supply, areas, flow, mass, response and oil spring. Each
    line says "fits", "does not fit" or "cannot be told", with the numbers. Where all fits, the
    last line tells how small a leak, a friction and a dead band the record can show; --json and
    rig_check.json have all effects. The exit code is 0 whatever fits.

    Example: ehsid rig check rig.toml run1.csv run2.mf4 --out check
    """
    from ..fitness import rig_check_file
    from ..rigs import read_rig
    from ..show.rig_check import files_of, pictures_of, write_rig_check

    if len(records) > MOST_RECORDS:
        raise ValueError(f"{len(records)} records: expected at most {MOST_RECORDS}; name fewer")
    pictures = pictures_of(len(records))
    placing = (
        nullcontext()
        if out is None
        else result_folder(out, "rig-check", files_of(len(records)), [rig_file, *records])
    )
    with placing as folder:
        rig = read_rig(rig_file)
        hints = hints_of(maps, sampling_time)
        required = ["time_s", "command_v", "position_m"]
        checks = [
            _checked(read_shown(path, hints, required=required, layout=rig.columns), rig)
            for path in records
        ]
        result = rig_check_file(rig.name, checks)
        if folder is not None:
            write_rig_check(folder, rig, checks)
    if as_json:
        typer.echo(json.dumps(to_plain(result), allow_nan=False))
        return
    console = Console()
    _print(checks, console)
    if out is not None:
        console.print(f"pictures: {', '.join(str(out / name) for name in pictures)}")
