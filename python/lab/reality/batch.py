# SPDX-License-Identifier: MIT
"""Many blind cases at once: mixed kinds, random folder names, the answers in a separate file.

Folder of a blind case: rig.toml, train.csv, validate.csv, and nothing of what is withheld.
"""

from __future__ import annotations

import functools
import glob
import io
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.files import result_files, result_folder, write_text
from ehsid.harness.base.parallel import run_tasks

from .case import KINDS, Kind, RealityCase, Sensors, make_case
from .excitation import ExcitationSet
from .nominal_rig import PlantKind
from .variants import Grade

FILES = ("rig.toml", "train.csv", "validate.csv")
FORMATS = {
    "time_s": "%.6g",
    "command_v": "%.5f",
    "position_m": "%.7f",
    "spool": "%.5f",
}


def record_text(record: Mapping[str, npt.NDArray[np.float64]]) -> str:
    """Returns the record as CSV text with a header line."""
    text = io.StringIO()
    np.savetxt(
        text,
        np.column_stack(list(record.values())),
        fmt=[FORMATS.get(name, "%.0f") for name in record],
        delimiter=",",
        header=",".join(record),
        comments="",
    )
    return text.getvalue()


def write_case(case: RealityCase, folder: str | os.PathLike[str]) -> None:
    """Writes the three files of a case, each whole or not at all; creates the folder."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    texts = (case.rig_toml, record_text(case.train), record_text(case.validate))
    for name, text in zip(FILES, texts, strict=True):
        write_text(target / name, text)


FEW_S = 5e-3  # from this sampling time on a record of the grade "field" is long
SHARES = {"one": 0.5, "two": 0.15, "none": 0.1, "params": 0.1, "open": 0.15}


BESIDE_LINKAGE = 0.4  # share of the linkages that have an effect of the catalogue


def draw_kind(seed: int, grade: Grade) -> Kind:
    """Draws the kind of the case with this seed; half of all cases have one effect.

    Of a linkage it tells the effects beside it: one in two of five cases, and else none.
    """
    stream = np.random.default_rng((seed, 7))
    if grade == "linkage":
        return "one" if stream.random() < BESIDE_LINKAGE else "open"
    return KINDS[int(stream.choice(len(KINDS), p=[SHARES[kind] for kind in KINDS]))]


def draw_sensors(seed: int, grade: Grade) -> Sensors:
    """Draws the sensors: the position only in confusable cases and in a third of the others."""
    if grade == "confusable":
        return "position"
    stream = np.random.default_rng((seed, 8))
    return ("pressures+supply", "pressures", "position")[int(stream.integers(3))]


def draw_seconds(seed: int, grade: Grade) -> float:
    """Draws the length of the records of a case, independently of its effect.

    8 to 20 s; 30 to 60 s for slow records, those from abroad, and those of the grade "field" with a
    sample every 5 ms or fewer: they have fewer samples a second; 15 to 30 s for linkages, which
    take seconds for a stroke.
    """
    longer = {"slow": (30.0, 60.0), "abroad": (30.0, 60.0), "linkage": (15.0, 30.0)}
    if draw_sampling_time(seed, grade) >= FEW_S:
        longer["field"] = (30.0, 60.0)
    ends = longer.get(grade, (8.0, 20.0))
    return round(float(np.random.default_rng((seed, 9)).uniform(*ends)), 1)


def draw_sampling_time(seed: int, grade: Grade) -> float:
    """Draws the sampling time, s: 20 or 50 ms for slow records, 1 ms for plain and hard ones.

    Wide records have 0.5, 1, 2 or 4 ms, those from abroad 5, 10, 20 or 50 ms, linkages 1, 2 or 4,
    those of the grade "field" any of all these, or 100 ms.
    """
    choice = {
        "slow": (0.02, 0.05),
        "wide": (5e-4, 1e-3, 2e-3, 4e-3),
        "abroad": (5e-3, 1e-2, 2e-2, 5e-2),
        "linkage": (1e-3, 2e-3, 4e-3),
        "field": (5e-4, 1e-3, 2e-3, 4e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1),
    }.get(grade, (1e-3,))
    return choice[int(np.random.default_rng((seed, 10)).integers(len(choice)))]


def draw_logged_every(seed: int, grade: Grade) -> int:
    """Draws how many samples of the controller one of the log takes.

    2 in half of the logs from abroad; of slow ones of the grade "field" 2 or 5 in a quarter each.
    """
    if grade == "field" and draw_sampling_time(seed, grade) >= FEW_S:
        return (1, 1, 2, 5)[int(np.random.default_rng((seed, 11)).integers(4))]
    return 1 + int(grade == "abroad" and np.random.default_rng((seed, 11)).integers(2))


def write_drawn_case(
    folder: Path,
    seed: int,
    grade: Grade,
    kind: Kind | None,
    sensors: Sensors | None,
    plant: PlantKind = "ehs",
    seconds: float | None = None,
    effects: Sequence[str] | None = None,
    transfer: Path | None = None,
    among: ExcitationSet = "all",
    edited: Path | None = None,
) -> tuple[str, dict[str, Any]]:
    """Writes one case and returns its name and answer.

    The transfer record goes to `transfer`/NAME.csv, those after a change of the effects to
    `edited`/NAME/EDIT.csv, by the names of `case.EDITS`.
    """
    case = make_case(
        seed,
        grade,
        kind or draw_kind(seed, grade),
        effects,
        sensors="position" if plant == "axis" else sensors or draw_sensors(seed, grade),
        plant=plant,
        seconds=draw_seconds(seed, grade) if seconds is None else seconds,
        dt_s=draw_sampling_time(seed, grade),
        logged_every=draw_logged_every(seed, grade),
        among=among,
        edited=edited is not None,
    )
    write_case(case, folder / case.name)
    if transfer is not None:
        transfer.mkdir(parents=True, exist_ok=True)
        write_text(transfer / f"{case.name}.csv", record_text(case.transfer))
    if edited is not None:
        for edit, record in case.edited.items():
            (edited / case.name).mkdir(parents=True, exist_ok=True)
            write_text(edited / case.name / f"{edit}.csv", record_text(record))
    return case.name, dict(case.answer)


def write_cases(
    folder: str | os.PathLike[str],
    answers: str | os.PathLike[str],
    seeds: Sequence[int],
    grade: Grade = "plain",
    kind: Kind | None = None,
    sensors: Sensors | None = None,
    plant: PlantKind = "ehs",
    seconds: float | None = 20.0,
    progress: Callable[[float], None] | None = None,
    among: ExcitationSet = "all",
) -> None:
    """Writes folders of cases, and their answers by name to a file outside of them.

    They replace the cases and the answers of an earlier run.

    Parameters
    ----------
    kind, sensors
        kind and sensors of all cases; drawn for each case where None.
    seconds
        length of each record, s; drawn for each case where None.
    among
        set of which the excitations of wide cases are drawn.
    progress
        called with the share of the cases that is done.

    Raises
    ------
    ValueError
        the file of answers would lie in the folder of the cases, or as `result_folder`.
    """
    target, answers_file = Path(folder).resolve(), Path(answers).resolve()
    if target == answers_file.parent or target in answers_file.parents:
        raise ValueError(f"answers must not lie among the cases: {answers_file} is in {target}")
    answers_file.parent.mkdir(parents=True, exist_ok=True)
    names = [f"{glob.escape(target.name)}/*/{name}" for name in FILES]
    # The manifest is not put among the cases: every folder there is a case.
    with (
        result_files(answers_file, "reality") as answers_folder,
        result_folder(target.parent, f"reality-{target.name}", names) as cases,
    ):
        tasks = [
            functools.partial(
                write_drawn_case,
                *(cases / target.name, seed, grade, kind, sensors, plant, seconds),
                among=among,
            )
            for seed in seeds
        ]
        answers_by_name = dict(run_tasks(tasks, progress))
        write_text(
            answers_folder / answers_file.name,
            json.dumps(dict(sorted(answers_by_name.items())), indent=1) + "\n",
        )
