# SPDX-License-Identifier: MIT
"""Makes the page of a diagnosis: the answers first, then plots, details folded.

Writes the files of a diagnosis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.csv_text import csv_text
from ..base.files import write_text
from ..catalogue.channels import shown_channel
from ..diagnosis.edits import EditRun
from ..diagnosis.result import Diagnosis, HeldOutRun, diagnosis_text
from ..diagnosis.schema import NEXT_EXPERIMENT, Remark
from ..records import Origin, Record
from ..records.record import record_bytes
from ..rigs import rig_text
from .gap_plots import gap_bars, next_plots, run_blocks, value_table
from .gap_words import SIMULATIONS, named_effect, told_reasons, told_remarks
from .page import Bars, Block, Code, Folded, Heading, Items, Note, Page, Section, Table, Tagged
from .record_figure import gap_picture
from .rendering import render_page
from .seen_words import seen_blocks
from .units import percent, percent_interval
from .verdict_words import VERDICTS
from .where_section import change_of, diagnosis_facts, reading_folded, where_section
from .which_section import (
    again_command,
    experiment_steps,
    experiment_words,
    missing_law_section,
    wandering_section,
    which_section,
)


@dataclass(frozen=True)
class RecordLine:
    """Source of a record: its name, its role in the diagnosis, its file and its SHA-256.

    `origin` says how a log was read that does not follow the schema of records.
    """

    name: str
    role: str
    file: str
    sha256: str
    origin: Origin | None = None


def render_diagnosis(diagnosis: Diagnosis, records: Sequence[RecordLine], rig_file: str) -> str:
    """Returns the HTML page of a diagnosis, which needs no other files.

    Parameters
    ----------
    diagnosis
        the findings to show.
    records
        all records that the diagnosis used.
    rig_file
        path of the rig file, as the page shows it and uses it in a command.
    """
    badge, meaning = VERDICTS[diagnosis.verdict][:2]
    if diagnosis.verdict == "effects" and len(diagnosis.effects) > 1:
        badge = "Missing effects"
    serious = [_remark(remark) for remark in told_remarks(diagnosis) if remark.serious]
    number = f"{len(records)} record{'s' if len(records) > 1 else ''}"
    # Without added effects there is no third simulation to show.
    added = bool(diagnosis.effects or diagnosis.missing_laws)
    kinds = tuple(SIMULATIONS)[: 3 if added else 2]
    labels = {kind: SIMULATIONS[kind] for kind in kinds}
    sections = [
        where_section(diagnosis),
        which_section(diagnosis),
        missing_law_section(diagnosis.missing_laws, diagnosis.law_forms),
        wandering_section(diagnosis.wandering),
        _next(diagnosis, records, rig_file),
        _signals(diagnosis, kinds),
        _values(diagnosis),
        _limits(diagnosis),
        _settings(diagnosis, records),
    ]
    return render_page(
        Page(
            title=diagnosis.sentence,
            lead=[*([Items(serious)] if serious else []), meaning],
            sections=[section for section in sections if section.blocks],
            overline=f"Diagnosis of the gap between {diagnosis.rig.name} and its simulation"
            + (f" · {number}" if records else ""),
            badge=badge,
            kind=diagnosis.verdict,
            summary=[
                *gap_picture(diagnosis.runs, diagnosis.how_far, labels),
                diagnosis_facts(diagnosis),
                *gap_blocks(diagnosis, kinds),
                *reason_blocks(diagnosis),
            ],
            footer=[f"rig file {rig_file}", f"{diagnosis.seconds:.0f} s"],
            window_title=f"{badge}: {diagnosis.rig.name}",
        )
    )


def reason_blocks(diagnosis: Diagnosis) -> list[Block]:
    """Returns the reasons for the verdict with their heading; none where there are none."""
    reasons = told_reasons(diagnosis)
    return [Heading("Reasons for the verdict"), Items(reasons)] if reasons else []


def _remark(remark: Remark) -> Tagged:
    about = f"{remark.record}: " if remark.record else ""
    return Tagged(about + remark.what, "serious" if remark.serious else "")


def gap_blocks(diagnosis: Diagnosis, kinds: Sequence[str]) -> list[Block]:
    """Returns the picture of the gap of each simulation, and folded the gap by output.

    There are no blocks where the gap is not known.
    """
    gap = diagnosis.how_far
    if gap is None:
        return []
    window_s = diagnosis.settings.get("window_s", 0.5)
    outputs = ", ".join(shown_channel(name)[0] for name in diagnosis.outputs)
    change, word = change_of(gap.from_nominal)
    details: list[Block] = [
        Table(
            "",
            ("output", *(SIMULATIONS[kind] for kind in kinds)),
            [
                (shown_channel(name)[0], *map(percent, gaps[: len(kinds)]))
                for name, gaps in gap.per_output.items()
            ],
        ),
        "Compared with the simulator as configured, the gap of the last simulation is "
        f"{word} by {percent_interval(change)}.",
    ]
    if gap.carries_over is not None:
        small, large = map(percent, gap.carries_over)
        details.append(
            f"In held-out windows with small commands the added effects remove {small} of the gap "
            f"above the noise floor, in windows with large commands {large}. A wrong cause rarely "
            "helps at both."
        )
    if diagnosis.outputs_left_out:
        left_out = ", ".join(shown_channel(name)[0] for name in diagnosis.outputs_left_out)
        details.append(
            f"Not compared, because what they show within a window is noise: {left_out}."
        )
    meaning = Note(
        "Error on held-out data as a share of how much the signals move within "
        f"{window_s:g} s, mean of {outputs}. Below the noise floor nothing can be explained. In "
        "the files the simulations are called nominal, calibrated and augmented."
    )
    bars = Bars("gap on held-out data", gap_bars(gap, kinds))
    title = Heading("Error of the simulation on held-out data")
    return [title, bars, meaning, Folded("By output, and whether it carries over", details)]


def _signals(diagnosis: Diagnosis, kinds: Sequence[str]) -> Section:
    plots = run_blocks(diagnosis.runs, kinds)
    stretches = " in these stretches" if "fit and held out" in diagnosis.records.values() else ""
    text = (
        f"Held-out data, which no fit has seen{stretches}. In each window the position starts "
        "where it was measured and then follows the logged command alone, so the curves begin anew "
        "there. Drag over a stretch to zoom, click a name above a plot to hide its curve; the "
        "tools appear at the right of a plot."
    )
    return Section("Measured and simulated", [text, *plots] if plots else [])


def _next(diagnosis: Diagnosis, records: Sequence[RecordLine], rig_file: str) -> Section:
    title = "The next experiment"
    coming, record = diagnosis.next_experiment, diagnosis.next_record
    if coming is None or record is None:
        return Section(title, [])
    fitted = [one.file for one in records if one.role != "held out"]
    judged = [one.file for one in records if one.role == "held out"]
    return Section(
        title,
        [
            experiment_words(coming.description, coming.separates, coming.power),
            *next_plots(record),
            Items(
                [
                    *experiment_steps(coming.sensors),
                    "Diagnose again with the new record beside the old ones:",
                ],
                numbered=True,
            ),
            Code(again_command(fitted, judged, rig_file)),
        ],
    )


def _values(diagnosis: Diagnosis) -> Section:
    values = value_table(diagnosis, nuisances=False)
    nuisances = value_table(diagnosis, nuisances=True)
    blocks: list[Block] = []
    if values.rows:
        blocks += [
            "What the fit makes of the numbers in the rig file. The grey band is one standard "
            "deviation of what was known before; a value is marked where its move matters in size "
            "and cannot be chance.",
            values,
        ]
    if nuisances.rows:
        text = (
            "Every real servo has these; they are fitted inside bounds so that they do not come "
            "back as effects."
        )
        title = f"What no data sheet states ({len(nuisances.rows)})"
        blocks.append(Folded(title, [text, nuisances], unfolded=not values.rows))
    return Section("Values of the rig", blocks)


def _limits(diagnosis: Diagnosis) -> Section:
    blocks: list[Block] = [
        "Nothing could be judged, because these records cannot carry a diagnosis."
        if diagnosis.verdict == "insufficient_data"
        else "These records have the motion that each effect of the catalogue needs to show."
    ]
    if diagnosis.cannot_judge:
        rows = [(named_effect(effect.id), effect.why) for effect in diagnosis.cannot_judge]
        blocks = [
            "These effects may be there or not: the records do not show. Not judged does not mean "
            "absent.",
            Table("", ("effect", "why"), rows),
        ]
    blocks += seen_blocks(diagnosis.could_be_seen)
    if diagnosis.remarks:
        blocks += [Heading("About the records"), Items([*map(_remark, diagnosis.remarks)])]
    return Section("What could not be judged", blocks)


def _settings(diagnosis: Diagnosis, records: Sequence[RecordLine]) -> Section:
    files = [
        ("diagnosis.json", "All of this as data."),
        (
            "simulation.csv",
            "Held-out data beside the three simulations, so that anyone can recompute the gap.",
        ),
        (
            "rig.augmented.toml",
            "The rig with the estimated values and effects; this command runs it: ehsid simulate "
            "rig.augmented.toml --command RECORD",
        ),
    ]
    if diagnosis.next_experiment is not None:
        files.append(("next_experiment.csv", "The command to be sent next."))
    settings = [(name, _setting(value)) for name, value in diagnosis.settings.items()]
    return Section(
        "Records and settings",
        [
            Table(
                "",
                ("record", "role", "file", "SHA-256"),
                [(record.name, record.role, record.file, record.sha256) for record in records],
            ),
            *(reading_folded(one.name, one.origin) for one in records if one.origin is not None),
            Folded("Settings", [Table("", ("setting", "value"), settings)]),
            Folded("Files beside this page", [Table("", ("file", "contents"), files)]),
        ],
    )


def _setting(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(str(item) for item in value) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


# Significant digits in simulation.csv: they show a hundredth of the resolution of a 24-bit sensor.
DIGITS = 9


def write_diagnosis(
    folder: Path, diagnosis: Diagnosis, records: Sequence[Record], rig_file: str
) -> None:
    """Writes `RESULT_FILES` into a folder; that of the next experiment only if there is one.

    Parameters
    ----------
    folder
        exists; that of `ehsid.harness.base.files.result_folder` keeps earlier results until all
        files are written.
    diagnosis
        the findings to write.
    records
        all records that the diagnosis used, as they were read.
    rig_file
        path of the rig file, as the user gave it.

    Raises
    ------
    OSError
        the file system refuses to write.
    """
    write_text(folder / "diagnosis.json", diagnosis_text(diagnosis, records, rig_file))
    write_text(folder / "simulation.csv", csv_text(simulation_table(diagnosis.runs)))
    write_text(folder / "rig.augmented.toml", rig_text(diagnosis.augmented_rig))
    if diagnosis.next_record is not None:
        content = record_bytes(diagnosis.next_record, NEXT_EXPERIMENT)
        (folder / NEXT_EXPERIMENT).write_bytes(content)
    lines = [
        RecordLine(
            record.name,
            diagnosis.records.get(record.name, ""),
            str(record.source or record.name),
            record.sha256 or "",
            record.origin,
        )
        for record in records
    ]
    write_text(folder / "report.html", render_diagnosis(diagnosis, lines, rig_file))


def simulation_table(
    runs: Sequence[HeldOutRun | EditRun], kinds: Sequence[str] = tuple(SIMULATIONS)
) -> dict[str, npt.NDArray[Any]]:
    """Returns the samples inside windows with their simulations, one row for each sample.

    The columns are `record`, `time_s`, `window`, and for each output `OUTPUT_measured` and its
    simulations, such as `_nominal`, `_calibrated` and `_augmented`, which are fields of the runs.
    They are NaN where a record lacks the output. Numbers have nine significant digits.
    """
    names = list(dict.fromkeys(name for run in runs for name in run.measured))
    parts = [_part(run, names, ("measured", *kinds)) for run in runs]
    if not parts:
        return {"record": np.array([], str), "time_s": np.array([]), "window": np.array([], int)}
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _part(
    run: HeldOutRun | EditRun, names: Sequence[str], kinds: Sequence[str]
) -> dict[str, npt.NDArray[Any]]:
    inside = run.window >= 0
    empty = np.full(run.time_s.size, np.nan)
    numbers = {"time_s": run.time_s, "window": run.window} | {
        f"{name}_{kind}": getattr(run, kind).get(name, empty) for name in names for kind in kinds
    }
    records = {"record": np.full(np.count_nonzero(inside), run.record)}
    return records | {name: _rounded(values[inside]) for name, values in numbers.items()}


def _rounded(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if values.dtype.kind != "f":
        return values
    return np.array([float(f"{value:.{DIGITS}g}") for value in values.tolist()])
