# SPDX-License-Identifier: MIT
"""A servo with a hidden effect: measured, simulated before and after, and then the answer."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.parameters import value_name
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.records import Record, make_record, read_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.show.gap_page import write_diagnosis
from ehsid.harness.show.gap_words import interval, quantity, unit_of
from ehsid.harness.show.page import Link, Section, Table, Tagged
from ehsid.harness.show.plotting import CONFIGURED, FOUND, MEASURED, stacked, styled

FOLDER = Path(__file__).parent / "data" / "withheld"
RIG = FOLDER / "rig.toml"
REPORT = "diagnosis"
# Of 20 s: as much as the answer needs, in half of the time.
DIAGNOSED_S = 8.0
BEFORE, AFTER = "simulated before", "simulated after"
COLOURS = {BEFORE: CONFIGURED, AFTER: FOUND}


@dataclass(frozen=True, eq=False)
class Found:
    """The diagnosis, and the record that was not fitted beside its simulations."""

    diagnosis: Diagnosis
    record: Record
    simulated_m: Mapping[str, FloatArray]
    """Positions in metres over the record by BEFORE and AFTER."""


def beginning(record: Record, seconds: float) -> Record:
    """Returns the first seconds of a record."""
    assert record.time_s is not None
    kept = record.time_s < seconds
    columns = {name: values[kept] for name, values in record.columns.items()}
    return make_record(
        {"time_s": record.time_s[kept], **columns}, name=record.name, source=record.source
    )


def found_in_records(folder: Path, progress: Callable[[float], None]) -> Found:
    """Diagnose the beginning of both records, and write the report into `folder`."""
    rig = read_rig(RIG)
    train, held_out = (
        read_record(FOLDER / f"{name}.csv.gz", layout=rig.columns) for name in ("train", "validate")
    )
    used = [beginning(record, DIAGNOSED_S) for record in (train, held_out)]
    diagnosis = diagnose(used[:1], rig, validate=used[1:], progress=progress)
    (folder / REPORT).mkdir()
    write_diagnosis(folder / REPORT, diagnosis, used, RIG.name)
    rigs = {BEFORE: rig, AFTER: diagnosis.augmented_rig}
    return Found(diagnosis, held_out, {name: free_run(held_out, one) for name, one in rigs.items()})


def free_run(record: Record, rig: Rig) -> FloatArray:
    """Returns the position in metres that follows from the command alone, shape (n,)."""
    assert record.dt_s is not None
    start = float(record.column("position_m")[0])
    run = ehsid.simulate(
        ehsid.Rig(rig), record.column("command_v"), dt_s=record.dt_s, position0_m=start
    )
    return run.record["position_m"]


@styled
def position_figure(found: Found) -> Figure:
    """Measured and simulated position, and below it the errors."""
    figure, (upper, lower) = stacked(4.6, [2.4, 1.0], xlabel="time in s")
    measured = found.record.column("position_m")
    time = found.record.time_s
    assert time is not None
    upper.plot(
        time,
        1e3 * measured,
        color=MEASURED,
        linewidth=4.0,
        alpha=0.3,
        label="measured",
    )
    for name, position in found.simulated_m.items():
        upper.plot(time, 1e3 * position, color=COLOURS[name], linewidth=1.2, label=name)
        lower.plot(time, 1e3 * (position - measured), color=COLOURS[name], linewidth=1.2)
    upper.set_ylabel("position in mm")
    lower.set_ylabel("error in mm")
    upper.legend(loc="upper right", ncols=3)
    return figure


def largest_errors_mm(found: Found) -> tuple[float, float]:
    """Returns the largest error of the position, before and after."""
    measured = found.record.column("position_m")
    before, after = (
        float(1e3 * np.max(np.abs(found.simulated_m[name] - measured))) for name in (BEFORE, AFTER)
    )
    return before, after


def answer_table(diagnosis: Diagnosis) -> Table:
    """What was withheld, beside what was found."""
    answer = json.loads((FOLDER / "answer.json").read_text(encoding="utf-8"))
    found = {one.id: one for one in diagnosis.effects}
    rows: list[Sequence[str | Tagged]] = []
    for effect, sizes in answer["effects"].items():
        for key, size in sizes.items():
            name = ParameterKey.of_effect(effect, key)
            unit = unit_of(name)
            estimate = found[effect].parameters[key] if effect in found else None
            told = ("not found", "") if estimate is None else interval(estimate, unit)
            rows.append((Tagged(value_name(name), hint=name), "-", quantity(size, unit), *told))
    for name, truth in answer["rig"].items():
        value, unit = diagnosis.calibration[name], unit_of(name)
        rows.append(
            (
                Tagged(value_name(name), hint=name),
                quantity(value.rig, unit),
                quantity(truth, unit),
                *interval(value.found, unit),
            )
        )
    return Table(
        "",
        ("value", "rig file", "truth", "found", "90 % interval"),
        rows,
        marked=range(sum(len(sizes) for sizes in answer["effects"].values())),
    )


def answer_section(diagnosis: Diagnosis) -> Section:
    """What the machine really is, read only now, and where the whole report is."""
    return Section(
        "Was it right?",
        [
            (
                "What had been withheld is read only now. The records come from a simulator "
                "that shares no code with the one of the diagnosis. The first row is the effect; "
                "the others are values that the owner knew only roughly."
            ),
            answer_table(diagnosis),
            Link("The whole report of this diagnosis", f"{REPORT}/report.html"),
        ],
    )
