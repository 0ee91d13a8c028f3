# SPDX-License-Identifier: MIT
"""`ehsid gap-fleet`: diagnoses a folder of machines and ranks them by their gaps."""

from __future__ import annotations

import functools
import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import check_result_folder, result_folder
from ..records import NO_HINTS, Hints
from ..records.record import told_apart
from ..rigs import read_rig
from .console import Console, note, print_blocks, refuse
from .gap import ANY, FailOn, fail_if, failing_verdicts, read_for, with_diagnosis_options
from .options import AsJson, Dask, Maps, SamplingTime, Workers, hints_of, on

if TYPE_CHECKING:
    from ..diagnosis.job import Job
    from ..diagnosis.options import DiagnosisOptions
    from ..fleet import Fleet

MOST_LINES = 20
LOGGER = logging.getLogger("ehsid")


def read_machine(folder: Path, hints: Hints = NO_HINTS) -> Job:
    """Reads the rig file and the records of a machine.

    The results name each file by its path below the folder of the fleet.

    Raises
    ------
    ValueError, OSError
        a file is missing or cannot be used.
    """
    from ..diagnosis.job import Job
    from ..fleet import RIG, record_files

    fitted, held_out = record_files(folder)
    rig = read_rig(folder / RIG)
    named = [
        replace(record, source=record.source.relative_to(folder.parent))
        if record.source
        else record
        for record in told_apart(read_for(rig, [*fitted, *held_out], hints))
    ]
    count = len(fitted)
    return Job(folder.name, rig, f"{folder.name}/{RIG}", tuple(named[:count]), tuple(named[count:]))


def check_results(folder: Path, out: Path, machines: Sequence[Path]) -> None:
    """Checks the places of the results of these machines.

    Raises
    ------
    ValueError
        `out` or the place of a result lies in `folder`, where the next run would take it for a
        machine or a record; or a file that is not of an earlier result is in the way.
    """
    from ..diagnosis.job import ERROR, RESULT
    from ..diagnosis.schema import RESULT_FILES
    from ..fleet import INPUTS

    for place in (out, *(out / machine.name for machine in machines)):
        if place.resolve().is_relative_to(folder.resolve()):
            raise ValueError(f"--out {place}: lies in {folder}; name a folder outside of it")
    for machine in machines:
        check_result_folder(out / machine.name, RESULT, (*RESULT_FILES, INPUTS, ERROR))


@with_diagnosis_options
def gap_fleet_command(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="one sub-folder a machine")],
    out: Annotated[Path, typer.Option(help="folder of the results; the same again: goes on")],
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    *,
    options: DiagnosisOptions,
    workers: Workers = None,
    dask: Dask = None,
    fail_on: FailOn = None,
    as_json: AsJson = False,
) -> None:
    r"""Diagnose a folder of machines: whose gap is largest, and which of them share one.

    Each sub-folder of DIR is a machine: rig.toml and its records (CSV, TSV, Parquet, MAT, NPZ,
    Excel, HDF5, MF4, TDMS, MCAP, .bag; a .txt may be a note and is not read); records whose names
    start with "validate" are held out. A log of another layout is read as \[columns] of its rig
    file says, or as --map and --dt say, which apply to all machines. A machine that has been
    diagnosed is not diagnosed again until one of its files changes.

    Writes fleet.html, fleet.json and, for each machine, a folder with what `ehsid gap` writes.
    Exit code 2 where nothing could be diagnosed, 3 where a machine has a verdict of --fail-on; with
    "any", also where one could not be diagnosed.

    Examples: ehsid gap-fleet machines --out results

    ehsid gap-fleet machines --out results --fail-on any --quiet
    """
    from ..diagnosis import diagnose
    from ..fleet import machine_folders, read_fleet, run_fleet, unfinished_machines
    from ..show.fleet_page import FILES, write_fleet
    from ..show.gap_page import write_diagnosis
    from .progress import shown

    failing = failing_verdicts(fail_on)
    folders, refused = [], {}
    for machine in machine_folders(folder):
        if machine.name in FILES:
            refused[machine.name] = (
                f"{machine}: a file of the results has this name; give the folder another one"
            )
            note(f"{refused[machine.name]}; it is left out")
        else:
            folders.append(machine)
    hints = hints_of(maps, sampling_time)
    todo = unfinished_machines(folders, out, options, hints)
    check_results(folder, out, todo)
    with result_folder(out, "gap-fleet", FILES) as made:
        if len(todo) < len(folders):
            done = len(folders) - len(todo)
            note(f"{done} of {len(folders)} machines are finished; going on")
            for machine in folders:
                if machine not in todo:
                    LOGGER.info("%s: its files have not changed; its diagnosis is kept", machine)
        if todo:
            with on(dask, workers):
                read = functools.partial(read_machine, hints=hints)
                outcomes = run_fleet(todo, out, options, read, diagnose, write_diagnosis, hints)
                for _ in shown(outcomes, len(todo), len(folders)):
                    pass
        fleet = read_fleet(out, [machine.name for machine in folders], refused)
        write_fleet(fleet, made, out)
    page = out / "fleet.html"
    if as_json:
        typer.echo((out / "fleet.json").read_text(encoding="utf-8"), nl=False)
    else:
        _print(fleet, page, Console())
    if not fleet.ranked and not fleet.not_judged:
        refuse(f"{folder}: nothing could be diagnosed; see {page}")
    fail_if(_found(fleet, failing), "the results of these machines")


def _found(fleet: Fleet, failing: frozenset[str]) -> list[str]:
    """Returns the machines with these verdicts; where all verdicts but one count, errors too."""
    found = [
        f"{machine.name}: {machine.verdict}"
        for machine in (*fleet.ranked, *fleet.not_judged)
        if machine.verdict in failing
    ]
    if failing >= failing_verdicts(ANY):
        found += [f"{name}: could not be diagnosed" for name in fleet.failed]
    return found


def _print(fleet: Fleet, page: Path, console: Console) -> None:
    from ..show.fleet_page import fleet_lead, verdict_text
    from ..show.page import Table
    from ..show.units import percent

    for sentence in fleet_lead(fleet):
        console.print(sentence)
    rows = [
        (machine.name, percent(machine.structural), verdict_text(machine))
        for machine in fleet.ranked[:MOST_LINES]
    ]
    if rows:
        headings = ("machine", "structural gap", "verdict")
        print_blocks([Table("", headings, rows)], console)
    if len(fleet.ranked) > MOST_LINES:
        console.print(f"and {len(fleet.ranked) - MOST_LINES} more")
    console.print(f"\nreport: {page}", soft_wrap=True)
