# SPDX-License-Identifier: MIT
"""Draws the figures of the report of a check (`ehsid gap-check`).

Makes the tables of the report of a check (`ehsid gap-check`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import FuncFormatter

from ehsid.harness.catalogue.parameters import plain_name
from ehsid.harness.diagnosis.edits.testing import AGREES
from ehsid.harness.show.page import Table, Tagged
from ehsid.harness.show.plotting import BLUE, GREEN, GREY, GRID, VERMILION, draw_numbers, styled

from ..scoring.baselines import Baseline, Control, Promises
from ..scoring.figures import Figure, Reliability, RiskPoint, SizeError
from ..scoring.judging import SENSORS
from ..scoring.score import Contradiction, Score
from ..scoring.tables import Confusion, FigureTable, SplitTable
from ..scoring.wrong import WrongCase
from .check_words import KINDS, MARKS, figure_text, number, target_text

MET, MISSED, UNSURE = BLUE, VERMILION, GREY


@styled
def targets_drawing(table: FigureTable) -> Drawing:
    """Draws shares with their intervals and targets, with one panel for each set of sensors."""
    rows = [
        [
            figure
            for figure in table.columns[measured]
            if figure.target is not None and figure.unit == "share"
        ]
        for measured in SENSORS
    ]
    drawing = Drawing(figsize=(9, 0.6 + 0.36 * len(rows[0])))
    panels = drawing.subplots(1, 2, sharey=True)
    for axes, measured, figures in zip(panels, SENSORS, rows, strict=True):
        for place, figure in enumerate(figures):
            _target_row(axes, place, figure)
        axes.set_title(measured)
        axes.set_xlim(-2.0, 102.0)
        axes.set_xlabel("%")
        axes.grid(False, axis="y")
    panels[0].set_yticks(range(len(rows[0])), [figure.words for figure in rows[0]])
    panels[0].invert_yaxis()
    return drawing


def _target_row(axes: Axes, place: int, figure: Figure) -> None:
    target = figure.target
    assert target is not None
    left, right = 100.0 * max(target.least, 0.0), 100.0 * min(target.most, 1.0)
    axes.barh(place, right - left, left=left, height=0.7, color=GREEN, alpha=0.2, linewidth=0)
    if not figure.n:
        return
    colour = {"met": MET, "missed": MISSED}.get(figure.met, UNSURE)
    # Errors of sizes have no upper limit. Values beyond the axis are drawn at its edge.
    value, low, high = (min(100.0 * x, 101.0) for x in (figure.value, figure.low, figure.high))
    axes.plot([low, high], [place, place], color=colour, linewidth=2.0)
    axes.plot(value, place, "o", color=colour, markersize=6)


@styled
def confusion_drawing(confusion: Confusion, said: str, true: str) -> Drawing:
    """Draws the counts of a confusion matrix; the shade of a cell is its share of the row."""
    counts = np.array(confusion.counts, dtype=np.float64).reshape(
        len(confusion.rows), len(confusion.columns)
    )
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    height = 1.9 + 0.3 * max(len(confusion.rows), 1)
    drawing = Drawing(figsize=(9, height))
    axes = drawing.subplots()
    draw_numbers(axes, shares, [[f"{n:.0f}" if n else "" for n in row] for row in counts])
    names = [plain_name(name) for name in confusion.columns]
    kinds = [KINDS.get(name, plain_name(name)) for name in confusion.rows]
    axes.set_xticks(range(len(names)), names, rotation=45, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(kinds)), kinds)
    axes.set_xticks(np.arange(len(names) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(confusion.rows) + 1) - 0.5, minor=True)
    axes.grid(True, which="minor", color=GRID, alpha=1.0, linewidth=0.6)
    axes.tick_params(which="minor", length=0)
    axes.set_xlabel(said)
    axes.set_ylabel(true)
    return drawing


@styled
def trust_drawing(reliability: Reliability, risk: Sequence[RiskPoint]) -> Drawing:
    """Draws, left, the share of true effects over their probability; right, risk over coverage."""
    drawing = Drawing(figsize=(9, 4))
    left, right = drawing.subplots(1, 2)
    left.plot([0, 100], [0, 100], color=GREY, linewidth=1.0, linestyle="--")
    for group in reliability.bins:
        at, share = 100.0 * group.probability, group.true
        left.plot([at, at], [100.0 * share.low, 100.0 * share.high], color=MET, linewidth=2.0)
        left.plot(at, 100.0 * share.value, "o", color=MET, markersize=5)
    left.set_xlabel("stated probability, %")
    left.set_ylabel("names that are true, %")
    coverage = [100.0 * point.coverage for point in risk]
    right.fill_between(
        coverage,
        [100.0 * point.risk.low for point in risk],
        [100.0 * point.risk.high for point in risk],
        color=MISSED,
        alpha=0.15,
        linewidth=0,
        step="pre",
    )
    right.step(coverage, [100.0 * p.risk.value for p in risk], color=MISSED, where="pre")
    right.set_xlim(0.0, 100.0)
    right.set_ylim(bottom=0.0)
    right.set_xlabel("records with a name, the surest first, %")
    right.set_ylabel("names that are wrong, %")
    return drawing


@styled
def sizes_drawing(errors: Sequence[SizeError]) -> Drawing:
    """Draws the relative errors of the primary parameters, with one row for each effect.

    A marker is open where the interval of 90 % does not contain the true value.
    """
    primary = [error for error in errors if error.primary and math.isfinite(error.relative)]
    effects = sorted({error.of for error in primary})
    drawing = Drawing(figsize=(9, 1.2 + 0.3 * max(len(effects), 1)))
    axes = drawing.subplots()
    for inside, colour in ((True, MET), (False, MISSED)):
        some = [error for error in primary if error.inside == inside]
        axes.scatter(
            # A logarithmic axis cannot show an error of zero; it is drawn at 1e-3 %.
            [max(100.0 * error.relative, 1e-3) for error in some],
            [effects.index(error.of) for error in some],
            s=28,
            alpha=0.7 if inside else 1.0,
            label="interval of 90 % holds the truth" if inside else "it does not",
            facecolor=colour if inside else "none",
            edgecolor=colour,
        )
    if primary:  # An axis without data cannot be logarithmic.
        axes.set_xscale("log")
    axes.set_yticks(range(len(effects)), [plain_name(name) for name in effects])
    axes.invert_yaxis()
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel("error of the size, %")
    axes.grid(False, axis="y")
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, 1.0 + 0.5 / drawing.get_figheight()),
        ncols=2,
    )
    return drawing


@styled
def promises_drawing(each: Sequence[Promises]) -> Drawing:
    """Draws realised over predicted shrinkage with both intervals, one panel for each measure."""
    drawing = Drawing(figsize=(9, 4.4))
    panels = drawing.subplots(1, len(each), squeeze=False)[0]
    for axes, promises in zip(panels, each, strict=True):
        axes.plot([-20, 105], [-20, 105], color=GREY, linewidth=1.0, linestyle="--")
        for right, colour, label in ((True, MET, "answered right"), (False, MISSED, "not right")):
            some = [promise for promise in promises.each if promise.right == right]
            predicted = np.array(
                [[p.predicted.value, p.predicted.low, p.predicted.high] for p in some]
            )
            realised = np.array([[p.realised.value, p.realised.low, p.realised.high] for p in some])
            if not some:
                continue
            # A gap that grew by more than a fifth is drawn at the edge.
            x, y = (np.clip(100.0 * values, -20.0, 105.0) for values in (predicted, realised))
            axes.hlines(y[:, 0], x[:, 1], x[:, 2], color=colour, alpha=0.35, linewidth=1.0)
            axes.vlines(x[:, 0], y[:, 1], y[:, 2], color=colour, alpha=0.35, linewidth=1.0)
            axes.plot(x[:, 0], y[:, 0], "o", color=colour, markersize=4, label=label)
        axes.set_title(promises.words)
        axes.set_xlabel("predicted on held-out data, %")
        axes.set_ylabel("realised on the third record, %")
        if promises.each:
            axes.legend()
    return drawing


@styled
def edits_drawing(score: Score) -> Drawing:
    """Draws the gap with the edit over that without it, both over that before the change."""
    right = {case.name: case.names_right for case in score.cases}
    drawing = Drawing(figsize=(9, 4.4))
    panels = drawing.subplots(1, len(score.edits), squeeze=False, sharex=True, sharey=True)[0]
    for axes, edits in zip(panels, score.edits, strict=True):
        for wanted, colour, label in ((True, MET, "right names"), (False, MISSED, "other names")):
            some = [one for one in edits.each if right[one.case] == wanted]
            x, y = [one.found / one.own for one in some], [one.over_own for one in some]
            axes.plot(x, y, "o", color=colour, markersize=5, alpha=0.7, label=label)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.axline((1.0, 1.0), (2.0, 2.0), color=GREY, linewidth=1.0, linestyle="--")
        axes.axhline(AGREES, color=GREEN, linewidth=1.0)
        axes.set_title(f"effects {edits.edit}")
        axes.set_xlabel("gap of the rig as found, over that before")
        axes.legend()
    panels[0].set_ylabel("gap of the edited rig, over that before")
    return drawing


def target_table(table: FigureTable) -> Table:
    """Returns the table of the figures and their targets; rows with a missed target are marked."""
    rows: list[list[str]] = []
    missed: list[int] = []
    for pair in zip(*(table.columns[measured] for measured in SENSORS), strict=True):
        cells = [pair[0].words]
        for figure in pair:
            target = target_text(figure.target, figure.unit)
            cells += [figure_text(figure), ": ".join(filter(None, (target, MARKS[figure.met])))]
        if any(figure.met == "missed" for figure in pair):
            missed.append(len(rows))
        rows.append(cells)
    return Table(
        f"{table.title.capitalize()}.",
        ("figure", SENSORS[0], "target", SENSORS[1], "target"),
        rows,
        missed,
    )


def trust_table(score: Score) -> Table:
    """Returns the table of the share of right answers for each verdict."""
    return Table(
        "What a verdict is worth: how often the verdict and all that it names are right.",
        ("verdict", "right"),
        [(figure.words.replace("_", " "), figure_text(figure)) for figure in score.trust],
    )


def outcome_table(score: Score) -> Table:
    """Returns the table of the number of cases with each outcome, by grade."""
    grades = sorted({case.answer.grade for case in score.cases})
    outcomes = sorted(
        {case.judgement.outcome for case in score.cases}, key=lambda o: (o != "right", o)
    )
    pairs = [(case.judgement.outcome, case.answer.grade) for case in score.cases]
    rows = [
        (outcome, *(str(pairs.count((outcome, grade))) for grade in grades)) for outcome in outcomes
    ]
    return Table("Records by outcome.", ("outcome", *grades), rows)


def bins_table(reliability: Reliability) -> Table:
    """Returns the table of the named effects, grouped by the probability given to them."""
    return Table(
        "Named effects, by the probability with which they were named.",
        ("probability", "mean", "are there"),
        [
            (group.true.words, number(group.probability, "share"), figure_text(group.true))
            for group in reliability.bins
        ],
    )


def split_table(table: SplitTable) -> Table:
    """Returns the table of the main figures for each group of cases."""
    rows = [
        (
            KINDS.get(group, plain_name(group)),
            measured,
            *(figure_text(figure) for figure in figures),
        )
        for group, measured, figures in table.rows
    ]
    words = [figure.words for figure in table.rows[0][2]] if table.rows else []
    return Table(f"By {table.title}.", ("", "sensors", *words), rows)


def baseline_table(each: Sequence[Baseline]) -> Table:
    """Returns the table that compares the diagnosis with simpler ways to diagnose."""
    words = [figure.words for figure in each[0].figures] if each else []
    rows = []
    for baseline in each:
        texts = {figure.words: figure_text(figure) for figure in baseline.figures}
        rows.append((baseline.name, *(texts.get(name, "-") for name in words)))
    return Table(
        "Simpler methods, judged in the same way. 'effect first' counts only records with a gap of "
        "at least 3 x floor.",
        ("method", *words),
        rows,
        [0],
    )


def control_table(each: Sequence[Control]) -> Table:
    """Returns the table of the negative control, which compares the check with chance."""
    return Table(
        "Negative control: answers assigned at random among the records with the same sensors.",
        (
            *("figure", "this check", "chance", "mean of the assignments"),
            *("90 % of the assignments", "p", "assignments"),
        ),
        [
            (
                control.words,
                number(control.real, "share"),
                number(control.chance, "share"),
                number(control.mean, "share"),
                f"{number(control.low, 'share')} to {number(control.high, 'share')}",
                f"{control.p_value:.2g}",
                str(control.deals),
            )
            for control in each
        ],
    )


def wrong_table(each: Sequence[WrongCase]) -> Table:
    """Returns the table of all cases that were not answered right."""
    return Table(
        "All records that were not answered right, the worst first. Nats are the unit of the "
        "held-out log-likelihood: the record cannot distinguish two explanations that differ by "
        "less than 10 nats.",
        ("record", "grade, sensors", "outcome", "truth", "diagnosis", "possible reason"),
        [
            (
                case.name,
                f"{case.grade}, {case.sensors}",
                case.outcome,
                Tagged(plain_name(case.truth), hint=case.truth),
                Tagged(plain_name(case.said), hint=case.said),
                "; ".join(case.reasons) or "not known",
            )
            for case in each
        ],
    )


def contradiction_table(each: Sequence[Contradiction]) -> Table:
    """Returns the table of the diagnoses that contradict themselves."""
    return Table(
        "Diagnoses that contradict themselves. Each rule says what should hold.",
        ("record", "rule that is broken"),
        [(case.name, rule) for case in each for rule in case.rules],
    )
