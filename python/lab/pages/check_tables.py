# SPDX-License-Identifier: MIT
"""Makes the tables of the report of a check (`ehsid gap-check`)."""

from __future__ import annotations

from collections.abc import Sequence

from ehsid.harness.show.gap_words import plain_name
from ehsid.harness.show.page import Table, Tagged

from ..scoring.baselines import Baseline, Control
from ..scoring.calibration import Reliability
from ..scoring.reading import SENSORS
from ..scoring.score import Contradiction, Score
from ..scoring.tables import FigureTable, SplitTable
from ..scoring.wrong import WrongCase
from .check_words import KINDS, MARKS, figure_text, number, target_text


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
