# SPDX-License-Identifier: MIT
"""A servo whose effect is withheld: where the gap lies, which effect, how far; then the answer."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.show.gap_page import write_diagnosis
from ehsid.harness.show.gap_plots import curves_of
from ehsid.harness.show.gap_words import (
    SIMULATIONS,
    effect_set,
    interval,
    quantity,
    unit_of,
    value_name,
)
from ehsid.harness.show.page import Link, Picture, Section, Table, Tagged
from ehsid.harness.show.plotting import BLUE, GREEN, stacked, styled
from ehsid.harness.show.units import percent
from ehsid.harness.show.where_section import where_section
from ehsid.harness.show.which_section import which_section

FOLDER = Path(__file__).parent / "data" / "withheld"
RIG = FOLDER / "rig.toml"
REPORT = "diagnosis"
# Kinds of simulation whose errors are drawn.
ERRORS = {"calibrated": BLUE, "augmented": GREEN}
# More than a line of this width can show.
MOST_SAMPLES = 4000


@styled
def error_figure(diagnosis: Diagnosis) -> Figure:
    """Errors of the simulations, with and without the effect, one panel an output."""
    run = diagnosis.runs[0]
    figure, panels = stacked(1.7 * len(run.measured), [1.0] * len(run.measured), xlabel="time in s")
    for panel, name in zip(panels, run.measured, strict=True):
        words, factor, unit = shown_channel(name)
        curves = curves_of(run, name, tuple(ERRORS), scale=factor, most=MOST_SAMPLES)
        for kind, colour in ERRORS.items():
            error = curves[f"{kind}_error"]
            panel.plot(curves["time"], error, color=colour, linewidth=0.8, label=SIMULATIONS[kind])
        panel.set_ylabel(f"{words}\nin {unit}")
    panels[0].legend(loc="upper right", ncols=2)
    return figure


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
        "The answer: what the machine really is, and what the diagnosis made of its records.",
        ("value", "rig file", "truth", "found", "90 % interval"),
        rows,
        marked=range(sum(len(sizes) for sizes in answer["effects"].values())),
    )


@dataclass(frozen=True, eq=False)
class Opening:
    """What the page begins with: the diagnosis, a sentence on it, and its sections."""

    diagnosis: Diagnosis
    lead: str
    sections: Sequence[Section]


def withheld_record(folder: Path, progress: Callable[[float], None]) -> Opening:
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
    errors = Section(
        "With and without the effect",
        [
            (
                "Two records of a servo, 20 s at 1 kHz each, and a rig file with what its owner "
                "knows. The machine has an effect that the file does not name. One record is "
                "fitted, the other one is only judged by."
            ),
            Picture(
                error_figure(diagnosis),
                "Simulated minus measured on the record that was not fitted. Each stretch starts "
                "from the measured state.",
                "Errors over time for each output; with the effect they are much smaller.",
            ),
            Link(
                "The whole report of this diagnosis, with plots that zoom", f"{REPORT}/report.html"
            ),
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
        "This servo has an effect that was withheld from its rig file and from the diagnosis. The "
        f"diagnosis names {effects}. On a record that was not fitted, the error of the simulation "
        f"falls from {percent(far.nominal)} of the motion with the rig file as it is to "
        f"{percent(far.augmented)} with what the diagnosis found."
    )
    sections = [where_section(diagnosis), which_section(diagnosis), errors, answer]
    return Opening(diagnosis, lead, sections)
