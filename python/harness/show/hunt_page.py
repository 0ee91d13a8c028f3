# SPDX-License-Identifier: MIT
"""The page of a hunt: what was run, what it told, and how far the machine went."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.encoding import json_text
from ..base.files import write_text
from ..catalogue.channels import POSITION
from ..hunt.hunting import Cause, Hunt, Hunted, HuntExperiment, HuntStep
from ..hunt.running import Experiment, Ran
from ..records import write_record
from . import rendering
from .gap_page import write_diagnosis
from .gap_words import effect_set, first_upper
from .page import Block, Cell, Link, Page, Picture, Section, Table
from .plotting import COMMAND, FOUND, GREY, MEASURED, VERMILION, stacked, styled
from .units import percent
from .verdict_words import VERDICTS

DIAGNOSIS = "diagnosis"
REPORT = f"{DIAGNOSIS}/report.html"
FILES = ("hunt.html", "hunt.json", "experiment*.csv", f"{DIAGNOSIS}/*")
EXPERIMENTS = ("experiment", "made to separate", "expected to tell", "what is left then")
# Frames of the moving picture for each experiment.
FRAMES = 8
OUTSIDE = "a cause outside the catalogue"


def write_hunt(hunted: Hunted, folder: Path, rig_file: str) -> None:
    """Writes the files `FILES` into a folder that exists."""
    write_text(folder / "hunt.json", json_text(hunted.told))
    for _, ran in hunted.ran:
        if ran.record is not None:
            write_record(ran.record, folder / f"{ran.record.name}.csv")
    (folder / DIAGNOSIS).mkdir()
    write_diagnosis(folder / DIAGNOSIS, hunted.diagnosis, hunted.records, rig_file)
    rendering.write_page(folder / "hunt.html", hunt_page(hunted, REPORT))


def hunt_lead(hunt: Hunt) -> list[str]:
    """Returns the result in two or three sentences."""
    lead = [hunt.sentence, hunt.steps[-1].sentence]
    stopped = [one for one in hunt.experiments if one.stopped]
    if stopped:
        times = "once" if len(stopped) == 1 else f"{len(stopped)} times"
        lead.append(f"The guard of the limits ended an experiment early {times}.")
    return lead


def experiment_rows(hunt: Hunt) -> list[tuple[str, str, str, str]]:
    """Returns the rows of a table with the head `EXPERIMENTS`."""
    rows = []
    for step in hunt.steps:
        if not step.experiments:
            rows.append(("records that were given", "", "", _left(step)))
        for one in step.experiments:
            is_last = one is step.experiments[-1]
            separates = " from ".join(map(effect_set, one.separates)) or "a first look"
            what = first_upper(one.description) + (
                f" (stopped: {one.stopped})" if one.stopped else ""
            )
            rows.append((what, separates, _expected(one), _left(step) if is_last else ""))
    return rows


def _expected(one: HuntExperiment) -> str:
    if one.nats is None or one.power is None:
        return ""
    return f"{one.nats:.0f} nats; separated with {percent(one.power)}"


def _left(step: HuntStep) -> str:
    causes = [_cause(one) for one in step.causes]
    return " or ".join(causes) or VERDICTS[step.verdict].title.lower()


def _cause(cause: Cause) -> str:
    told = "" if cause.probability is None else f" ({percent(cause.probability)})"
    return effect_set(cause.effects) + told


def hunt_page(hunted: Hunted, report: str | None = None) -> Page:
    """Returns the whole page; it leads to the report of the last diagnosis, if there is one."""
    hunt = hunted.told
    blocks: list[Block] = [
        Table(
            "",
            EXPERIMENTS,
            experiment_rows(hunt),
            note="An experiment is chosen for what it is expected to tell: the evidence between "
            "the most probable set and the one that is hardest to separate from it, in nats.",
        ),
    ]
    if report is not None:
        blocks.append(Link("The last diagnosis, with all figures", report))
    sections = [Section("From experiment to experiment", blocks)]
    if hunted.ran:
        sections.append(Section("Within the limits", [_limits(hunt)]))
    for place, (experiment, ran) in enumerate(hunted.ran, 1):
        if ran.record is not None:
            sections.append(Section(f"Experiment {place}", [_record_picture(experiment, ran)]))
    return Page(
        hunt.sentence,
        hunt_lead(hunt)[1:],
        sections,
        overline=f"The hunt for a cause: {hunt.machine}",
        badge=VERDICTS[hunt.steps[-1].verdict].title,
        kind=hunt.steps[-1].verdict,
        summary=[moving_picture(hunted)],
        window_title=f"Hunt: {hunt.machine}",
    )


def _limits(hunt: Hunt) -> Table:
    limits = hunt.limits
    rows: list[list[Cell]] = [
        [
            "limit",
            f"{1e3 * limits.position_m[0]:.4g} to {1e3 * limits.position_m[1]:.4g}",
            f"{limits.command_v:.3g}",
            _or_none(1e3 * limits.speed_m_s),
            _or_none(1e-5 * limits.pressure_pa),
        ]
    ]
    for place, one in enumerate(hunt.experiments, 1):
        pressure = None if one.pressure_pa is None else 1e-5 * one.pressure_pa
        rows.append(
            [
                f"experiment {place}",
                f"{1e3 * one.position_m[0]:.4g} to {1e3 * one.position_m[1]:.4g}",
                f"{one.command_v:.3g}",
                f"{1e3 * one.speed_m_s:.3g}",
                "not measured" if pressure is None else f"{pressure:.3g}",
            ]
        )
    return Table(
        "How far the machine went, from the approach to the rest behind each experiment.",
        ("", "position, mm", "command, V", "speed, mm/s", "chamber pressure, bar"),
        rows,
        note="Before each command the guard looks at position, speed and pressures. It ends an "
        "experiment where the rod could not stop any more before an end of its travel, or at nine "
        "tenths of the limits of speed and pressure.",
    )


def _or_none(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "none"


def _record_picture(experiment: Experiment, ran: Ran) -> Picture:
    assert ran.record is not None
    stopped = f" The guard ended it: {ran.stopped}." if ran.stopped else ""
    return Picture(
        _experiment_figure(experiment, ran),
        f"{first_upper(experiment.description)}: the command as sent, and the position as measured "
        f"beside the one that the best cause so far predicted.{stopped}",
        "Command, and measured and predicted position, over time",
    )


@styled
def _experiment_figure(experiment: Experiment, ran: Ran) -> Figure:
    assert ran.record is not None
    figure, (above, below) = stacked(4.2, [1.0, 1.4], xlabel="time in s")
    time = experiment.dt_s * np.arange(experiment.command_v.size)
    taken = time[: len(ran.record)]
    above.plot(taken, ran.record.column("command_v"), color=COMMAND, linewidth=0.8)
    above.set_ylabel("command in V")
    below.plot(time, 1e3 * experiment.path_m, color=FOUND, label="predicted")
    below.plot(taken, 1e3 * ran.record.column(POSITION), color=MEASURED, label="measured")
    below.set_ylabel("position in mm")
    below.legend(loc="upper right", ncols=2)
    return figure


def hunt_figure(hunted: Hunted) -> Figure:
    """Returns the rod in all experiments, and what is left as the cause."""
    return _frame(hunted, hunted.ran, hunted.told.steps[-1], 1.0)


def moving_picture(hunted: Hunted) -> Picture:
    """Returns the hunt as a moving picture: the rod moves, then the probabilities do."""
    frames: list[Figure] = []
    ran = iter(hunted.ran)
    told: HuntStep | None = None
    past: list[tuple[Experiment, Ran]] = []
    for step in hunted.told.steps:
        for _ in step.experiments:
            past.append(next(ran))
            frames += [_frame(hunted, past, told, share / FRAMES) for share in range(1, FRAMES + 1)]
        told = step
        frames.append(_frame(hunted, past, told, 1.0))
    return Picture(
        hunt_figure(hunted),
        "Left: the position of the rod in the experiments. Right: what may be the cause, with its "
        "probability, after each diagnosis.",
        "Position of the rod over time, and bars of the probabilities of the causes",
        frames[:-1],
    )


@styled
def _frame(
    hunted: Hunted, past: Sequence[tuple[Experiment, Ran]], told: HuntStep | None, share: float
) -> Figure:
    figure = Figure(figsize=(9.0, 3.4))
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    _draw_rod(left, hunted, past, share)
    _draw_causes(right, hunted.told, told)
    return figure


def _draw_rod(
    axes: Axes, hunted: Hunted, past: Sequence[tuple[Experiment, Ran]], share: float
) -> None:
    """The experiments one behind the other; the last one as far as this share."""
    records = [ran.record for _, ran in hunted.ran if ran.record is not None]
    shown = [ran.record for _, ran in past if ran.record is not None]
    begin = 0.0
    for place, record in enumerate(shown):
        time = np.asarray(record.time_s)
        count = len(record) if place + 1 < len(shown) else round(share * len(record))
        step = max(1, count // 600)
        position = 1e3 * record.column(POSITION)[:count:step]
        axes.plot(begin + time[:count:step], position, color=MEASURED, linewidth=0.9)
        begin += float(time[-1]) + 1.0
    whole = sum(float(np.asarray(record.time_s)[-1]) + 1.0 for record in records)
    axes.set_xlim(0.0, max(whole, 1.0))
    reached = [1e3 * record.column(POSITION) for record in records]
    if reached:
        low, high = min(p.min() for p in reached), max(p.max() for p in reached)
        room = 0.1 * max(high - low, 1e-3)
        axes.set_ylim(low - room, high + room)
    axes.set_xlabel("time in s, experiment after experiment")
    axes.set_ylabel("position in mm")


def _draw_causes(axes: Axes, hunt: Hunt, told: HuntStep | None) -> None:
    """The same causes in the same order in each frame."""
    names = dict.fromkeys(one.effects for step in hunt.steps for one in step.causes)
    bars = {effect_set(effects): 0.0 for effects in names}
    bars[OUTSIDE] = 0.0
    if told is not None:
        bars |= {effect_set(one.effects): one.probability or 0.0 for one in told.causes}
        bars[OUTSIDE] = told.outside_probability or 0.0
    places = np.arange(len(bars))
    colours = [GREY if name == OUTSIDE else VERMILION for name in bars]
    axes.barh(places, [100.0 * value for value in bars.values()], height=0.5, color=colours)
    axes.set_yticks(places, list(bars))
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("probability in %")
