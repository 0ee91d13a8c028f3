# SPDX-License-Identifier: MIT
"""What a diagnosis at work knows so far, in files that the page draws.

Each stage has a folder of its own below `so_far/`, in the order of the stages: signals first, and
`so_far.json` last, so that a page reads a stage whole or not at all.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import write_text
from ehsid.harness.diagnosis.result import HeldOutRun, Interim, Stage

from .downsampling import make_pyramid, store

FOLDER, FILE, TIME = "so_far", "so_far.json", "time"
FOUND = Path("looks", "_gap")  # signals of the last diagnosis; no record can have this name
SIMULATED = ("nominal", "calibrated", "augmented")
ERROR = "_error"  # behind a kind of simulation: simulated minus measured
MOST_SETS = 6


class Run(msgspec.Struct, frozen=True):
    """A held-out record: its name and its outputs; see `key`."""

    record: str
    outputs: list[str]


class SoFar(msgspec.Struct, frozen=True):
    """What is known when a stage begins."""

    stage: Stage
    """What is done now."""
    past: list[Stage]
    """The stages before."""
    nominal: float | None
    calibrated: float | None
    augmented: float | None
    floor: float | None
    """Gap of the simulation as configured, with the values of the rig fitted, with the set that is
    ahead, and the upper end of the noise floor, all as nrmse; None where a simulation diverges."""
    ahead: list[str]
    """Ids of the effects of the set that is ahead."""
    sets: list[tuple[list[str], float]]
    """The best sets with the nrmse that each leaves, smallest first."""
    runs: list[Run]
    """Held-out records that can be drawn."""


def key(run: int, output: int, kind: str) -> str:
    """Returns the key of a signal: measured, a kind of simulation, or its error."""
    return f"{run}_{output}_{kind}"


def forget(session: Path) -> None:
    """Removes what an earlier diagnosis of a session has left."""
    shutil.rmtree(session / FOLDER, ignore_errors=True)


def keep(session: Path, interim: Interim, past: list[Stage]) -> None:
    """Writes what is known at the begin of a stage into the folder of a session."""
    folder = session / FOLDER / f"{len(past):02d}"
    runs = _store_runs(folder, interim.runs)
    far = interim.how_far
    known = SoFar(
        interim.stage,
        past,
        _number(far.nominal),
        _number(far.calibrated),
        _number(far.augmented),
        _number(far.noise_floor[1]),
        list(interim.ahead),
        [(list(effects), left) for effects, left in interim.sets[:MOST_SETS]],
        runs,
    )
    write_text(folder / FILE, json_text(known))


def keep_found(session: Path, runs: Sequence[HeldOutRun]) -> None:
    """Writes the signals of a diagnosis that has ended, in place of those of an earlier one."""
    shutil.rmtree(session / FOUND, ignore_errors=True)
    write_text(session / FOUND / FILE, json_text(_store_runs(session / FOUND, runs)))


def found_runs(session: Path) -> list[Run]:
    """Returns which signals the last diagnosis has left; none where they are not kept."""
    return read_json(session / FOUND / FILE, list[Run]) or []


def _number(gap: float) -> float | None:
    return gap if math.isfinite(gap) else None


def _store_runs(folder: Path, runs: Sequence[HeldOutRun]) -> list[Run]:
    folder.mkdir(parents=True)
    for number, run in enumerate(runs):
        _store_run(folder, number, run)
    return [Run(run.record, list(run.measured)) for run in runs]


def _store_run(folder: Path, number: int, run: HeldOutRun) -> None:
    np.save(folder / f"{number}_{TIME}.npy", run.time_s)
    inside = run.window >= 0
    for place, name in enumerate(run.measured):
        measured = run.measured[name]
        signals = {"measured": measured}
        for kind in SIMULATED:
            signals[kind] = np.where(inside, getattr(run, kind)[name], np.nan)
            signals[kind + ERROR] = signals[kind] - measured
        for kind, values in signals.items():
            store(make_pyramid(values), folder, key(number, place, kind))


def latest(session: Path) -> tuple[Path, SoFar] | None:
    """Returns the last stage of a session that is whole, with its folder; None without one."""
    try:
        folders = sorted((session / FOLDER).iterdir(), reverse=True)
    except OSError:
        return None
    for folder in folders:
        known = read_json(folder / FILE, SoFar)
        if known is not None:
            return folder, known
    return None
