# SPDX-License-Identifier: MIT
"""A servo whose effect is withheld: where the gap lies, which effect, how far; then the answer."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from real_record import Part

from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.gap import diagnose
from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.records import read_record
from ehsid.harness.report.diagnosis_files import write_diagnosis
from ehsid.harness.report.gap_words import (
    effect_set,
    first_upper,
    interval,
    plain_name,
    quantity,
    unit_of,
    value_name,
)
from ehsid.harness.report.page import Picture, Section, Table
from ehsid.harness.report.shares import percent, percent_interval
from ehsid.harness.rigs import read_rig

FOLDER = Path(__file__).parent / "data" / "withheld"
RIG = FOLDER / "rig.toml"
REPORT = "diagnosis"
SHOWN_CANDIDATES = 5


def where_table(diagnosis: Diagnosis) -> Table:
    """One row a subsystem."""
    shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
    rows = [(name, percent(share)) for name, share in shares]
    return Table(
        "Where: what each subsystem has of the gap that remains when the values of the rig are "
        "fitted.",
        ("subsystem", "share of the gap"),
        rows,
        marked=[0],
    )


def which_table(diagnosis: Diagnosis) -> Table:
    """One row a set of effects that was tried."""
    best = diagnosis.candidates[:SHOWN_CANDIDATES]
    rows = [
        (effect_set(one.effects), percent(one.held_out_shrinkage), f"{one.score:.1f}")
        for one in best
    ]
    return Table(
        "Which: the effects of the catalogue, each fitted to one record and judged on the other. "
        "Marked: the best, and those that the data cannot tell from it.",
        ("candidate", "share of the remaining gap removed", "behind the best, nats"),
        rows,
        marked=[i for i, one in enumerate(best) if one.in_confidence_set],
    )


def how_far_table(diagnosis: Diagnosis) -> Table:
    """One row an output."""
    far = diagnosis.how_far
    assert far is not None
    rows = [
        (shown_channel(name)[0], *(percent(gap) for gap in gaps))
        for name, gaps in far.per_output.items()
    ]
    means = (far.nominal, far.calibrated, far.augmented)
    rows.append(("all outputs", *(percent(gap) for gap in means)))
    floor = " to ".join(percent(share) for share in far.noise_floor)
    explained = (
        ""
        if far.of_explainable is None
        else " Of the gap above the noise floor that remained after the fit, the effect removes "
        f"{percent_interval(far.of_explainable)}."
    )
    return Table(
        "How far: error of the simulation on the record that was not fitted, as a share of the "
        f"output's own spread. Sensor noise alone leaves {floor}.{explained}",
        ("output", "simulator as configured", "rig values fitted", "with the effect"),
        rows,
        marked=[len(rows) - 1],
    )


def error_figure(diagnosis: Diagnosis) -> Figure:
    """What the simulations leave of the measured signals, one panel an output."""
    run = diagnosis.runs[0]
    figure = Figure(figsize=(9.0, 1.7 * len(run.measured)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(len(run.measured), 1, sharex=True))
    # A line would join the end of a window to the start of the next one.
    ends = np.flatnonzero(np.diff(run.window, append=-1) != 0)
    kinds = (
        ("rig values fitted", "C1", run.calibrated),
        ("with the effect", "C0", run.augmented),
    )
    for panel, (name, measured) in zip(panels, run.measured.items(), strict=True):
        words, factor, unit = shown_channel(name)
        for label, colour, simulated in kinds:
            error = factor * (measured - simulated[name])
            error[ends] = np.nan
            panel.plot(run.time_s, error, colour, lw=0.8, label=label)
        panel.set_ylabel(f"{words}\n{unit}")
        panel.grid(alpha=0.3)
    panels[0].legend(loc="upper right", ncols=2, fontsize="small")
    panels[-1].set_xlabel("time, s")
    return figure


def answer_table(diagnosis: Diagnosis) -> Table:
    """What was withheld, beside what was found."""
    answer = json.loads((FOLDER / "answer.json").read_text(encoding="utf-8"))
    found = {one.id: one for one in diagnosis.effects}
    rows: list[Sequence[str]] = []
    for effect, sizes in answer["effects"].items():
        for key, size in sizes.items():
            unit = unit_of(ParameterKey.of_effect(effect, key))
            estimate = found[effect].parameters[key] if effect in found else None
            told = ("not found", "") if estimate is None else interval(estimate, unit)
            rows.append(
                (f"{plain_name(effect)}: {plain_name(key)}", "-", quantity(size, unit), *told)
            )
    for name, truth in answer["rig"].items():
        value, unit = diagnosis.calibration[name], unit_of(name)
        rows.append(
            (
                value_name(name),
                quantity(value.rig, unit),
                quantity(truth, unit),
                *interval(value.found, unit),
            )
        )
    return Table(
        "The answer: what the machine really is, and what the diagnosis made of its records.",
        ("value", "rig file", "truth", "found", "90 % interval"),
        rows,
        marked=range(sum(len(sizes) for sizes in answer["effects"].values())),
    )


def withheld_record_sections(folder: Path, progress: Callable[[float], None]) -> Part:
    """Diagnose, write the whole report into `folder`, and only then read the answer."""
    rig = read_rig(RIG)
    train, validate = (
        read_record(FOLDER / f"{name}.csv.gz", layout=rig.columns) for name in ("train", "validate")
    )
    diagnosis = diagnose([train], rig, validate=[validate], progress=progress)
    (folder / REPORT).mkdir()
    write_diagnosis(folder / REPORT, diagnosis, [train, validate], RIG.name)
    far = diagnosis.how_far
    assert far is not None
    effects = effect_set(tuple(one.id for one in diagnosis.effects))
    question = Section(
        "Why do simulation and machine disagree? An effect that is withheld",
        [
            (
                "Two records of a servo, 20 s at 1 kHz each, and a rig file with what its owner "
                "knows. The machine has an effect that the file does not name. One record is "
                "fitted, the other one is only judged by."
            ),
            first_upper(diagnosis.sentence),
            where_table(diagnosis),
            which_table(diagnosis),
            how_far_table(diagnosis),
            (
                "Where the error grows when values are fitted, the fit bent them to make up for "
                "the effect on one record, and that does not carry over to the other."
            ),
            Picture(
                error_figure(diagnosis),
                "Measured minus simulated on the record that was not fitted. Each stretch starts "
                "from the measured state.",
                "Errors over time for each output; with the effect they are much smaller.",
            ),
            (f"The whole report, with plots that zoom: {REPORT}/report.html beside this page."),
        ],
    )
    answer = Section(
        "The answer",
        [
            (
                "Read only now. The records come from a generator that shares no code with the "
                "simulator of the diagnosis."
            ),
            answer_table(diagnosis),
        ],
    )
    lead = (
        f"A servo with an effect that was withheld: the diagnosis names {effects}, and the error "
        f"of the simulation falls from {percent(far.calibrated)} to {percent(far.augmented)} on a "
        "record that was not fitted."
    )
    return Part([lead], [question, answer])
