# SPDX-License-Identifier: MIT
"""`ehsid watch`: the dated logs of machines as one history, with alarms where something changed."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ..base.files import result_folder
from ..records import NO_HINTS, Hints, Record
from ..rigs import Rig
from .console import Console, note, print_blocks, refuse
from .gap import fail_if, read_for
from .options import AsJson, Dask, Maps, SamplingTime, Workers, hints_of, on

if TYPE_CHECKING:
    from ..watch.watching import Watch


def read_log(path: Path, rig: Rig, hints: Hints = NO_HINTS) -> Record:
    """Reads a log with the layout that the rig file or the options name."""
    (record,) = read_for(rig, [path], hints)
    return record


def watch_command(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="dated logs beside rig.toml, or one folder each")
    ],
    out: Annotated[Path, typer.Option(help="folder of the history; the same again: goes on")],
    track: Annotated[
        list[str] | None,
        typer.Option(
            metavar="EFFECT",
            help="effect whose size is watched, again for more; default: internal leakage, Coulomb "
            "friction, dead band and null bias of the valve",
            show_default=False,
        ),
    ] = None,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    workers: Workers = None,
    dask: Dask = None,
    fail_on: Annotated[
        Literal["change"] | None,
        typer.Option(help="exit code 3 if something changed, for CI", show_default=False),
    ] = None,
    as_json: AsJson = False,
) -> None:
    r"""Watch machines over months: when something changed, by how much, and what could be seen.

    DIR has rig.toml and the logs of a machine, or a sub-folder with them for each machine. The date
    of a log stands in its name, as in 2026-03-17.csv or run_20260317T0830.csv. Every log is fitted
    once, with the same effects; the sizes, the values of the rig and K, omega_n and xi of the
    estimator become courses over time. A change is told with its date and size. Where nothing
    changes there is one false alarm a year and machine.

    Writes watch.html, watch.json and history.sqlite, to which new logs are added. Exit code 2 for
    bad input.

    Examples: ehsid watch press7 --out history

    ehsid watch machines --out history --track entrained_air --fail-on change --quiet
    """
    from ..show.watch_page import FILES, write_watch
    from ..watch.store import FILE, opened
    from ..watch.tracking import WEAR
    from ..watch.watching import fit_and_keep, logs_in, new_logs, told_of
    from .progress import progress_of

    if out.resolve().is_relative_to(folder.resolve()):
        refuse(f"--out {out}: lies in {folder}; name a folder outside of it")
    # Nothing is written before all names and rig files are known to be right.
    machines = logs_in(folder, track or WEAR)
    read = functools.partial(read_log, hints=hints_of(maps, sampling_time))
    out.mkdir(parents=True, exist_ok=True)
    with opened(out / FILE) as history:
        new = new_logs(machines, history)
        if new:
            logs = f"{len(new)} log{'' if len(new) == 1 else 's'}"
            with on(dask, workers), progress_of(f"fitting {logs}") as progress:
                for count, _ in enumerate(fit_and_keep(new, history, read), 1):
                    progress(count / len(new))
        else:
            note("no log is new; the history is told again")
        watch = told_of(machines, history)
    with result_folder(out, "watch", FILES) as made:
        write_watch(watch, made)
    page = out / "watch.html"
    if as_json:
        typer.echo((out / "watch.json").read_text(encoding="utf-8"), nl=False)
    else:
        _print(watch, page, Console())
    if not any(machine.logs for machine in watch.machines):
        refuse(f"{folder}: no log could be fitted; see {page}")
    if fail_on is not None:
        fail_if([machine.name for machine in watch.machines if machine.changed], "a change")


def _print(watch: Watch, page: Path, console: Console) -> None:
    from ..show.page import Table
    from ..show.watch_page import CHANGES, change_rows, watch_lead

    for sentence in watch_lead(watch):
        console.print(sentence)
    rows = change_rows(watch)
    if rows:
        print_blocks([Table("", CHANGES, rows)], console)
    console.print(f"\nreport: {page}", soft_wrap=True)
