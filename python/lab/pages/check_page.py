# SPDX-License-Identifier: MIT
"""Renders the report of a check: how far a diagnosis can be trusted, and where it is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.show import rendering
from ehsid.harness.show.page import Block, Page, Picture, Section, Table
from ehsid.harness.show.rendering import markdown, write_pictures

from ..scoring.figures import Figure
from ..scoring.score import Score, score_file
from .check_plots import (
    baseline_table,
    bins_table,
    confusion_drawing,
    contradiction_table,
    control_table,
    edits_drawing,
    outcome_table,
    promises_drawing,
    sizes_drawing,
    split_table,
    target_table,
    targets_drawing,
    trust_drawing,
    trust_table,
    wrong_table,
)
from .check_words import HOW_TO_READ, figure_text, lead, number

TITLE = "How far to trust a diagnosis of the gap"
# The last one: the numbered pictures of the page.
FILES = ("report.html", "score.json", "check.md", "[0-9][0-9]_*.png")


def write_page(score: Score, folder: Path) -> None:
    """Writes the files `FILES` of a check into a folder that exists."""
    page = check_page(score)
    pictures = write_pictures(folder, page)
    write_text(folder / "score.json", json_text(score_file(score), indent=1))
    write_text(folder / "check.md", markdown(page, pictures))
    rendering.write_page(folder / "report.html", page)


def check_page(score: Score) -> Page:
    """Returns the page, from the most important figures to the list of all errors."""
    sections, summary = [], []
    if score.cases:
        summary = [_picture(score)]
        sections = [
            _figures(score),
            _confusions(score),
            _probabilities(score),
            _sizes(score),
            _transfer(score),
            *([_edits(score)] if score.edits else []),
            _baselines(score),
            _grades(score),
            Section("Where it is good and where not", _splits(score)),
            _wrong(score),
            _contradictions(score),
        ]
    return Page(TITLE, lead(score), [*sections, _how(score)], summary=summary)


def _splits(score: Score) -> list[Block]:
    """The worst family of machines in words, and the tables of all splits."""
    tables: list[Block] = [split_table(table) for table in score.splits if table.rows]
    families = score.splits[-1].rows
    if not families:
        return tables
    name, _, (right, *_) = families[0]
    return [f"The worst family is {name}: {figure_text(right)} of its cases are right.", *tables]


def _picture(score: Score) -> Picture:
    return Picture(
        targets_drawing(score.tables[0]),
        f"{score.tables[0].title.capitalize()}: values with 90 % intervals. The green areas are "
        "the targets. Blue: the target is met. Orange: it is missed. Grey: the interval reaches "
        "across the limit of the target.",
        "Figures of the check with intervals beside their targets",
    )


def _figures(score: Score) -> Section:
    return Section(
        "Figures and targets",
        [
            HOW_TO_READ,
            target_table(score.tables[0]),
            trust_table(score),
            outcome_table(score),
        ],
    )


def _grades(score: Score) -> Section:
    words = (
        "Smooth and small records with the position only (confusable) contain too little to "
        "distinguish many effects. The right answer to them is a set that contains the truth; the "
        "targets of the first name are shown only for comparison. Slow records (20 and 50 ms) do "
        "not follow the oil spring; they have targets of their own."
    )
    return Section("Each grade by itself", [words, *map(target_table, score.tables[1:])])


def _confusions(score: Score) -> Section:
    return Section(
        "What is taken for what",
        [
            Picture(
                confusion_drawing(score.effects, "first named, or the verdict", "in the machine"),
                "Records with one cause or none. The numbers are numbers of records, and the shade "
                "is the share of the row. Right answers from the catalogue lie on the diagonal.",
                "Confusion matrix of effects",
            ),
            Picture(
                confusion_drawing(score.verdicts, "verdict", "kind of record"),
                "The machines have one or two effects of the catalogue, no effect, only wrong "
                "values of the rig, or one effect outside of the catalogue.",
                "Confusion matrix of verdicts",
            ),
        ],
    )


def _probabilities(score: Score) -> Section:
    reliability = score.reliability
    words = f"Number of named effects: {reliability.claims}."
    if reliability.claims:
        words += (
            f" The Brier score is {reliability.brier:.3f}. If every effect got the same "
            "probability, the share of names that are true, it would be "
            f"{reliability.brier_constant:.3f}. The expected calibration error is "
            f"{number(reliability.expected_error, 'share')}."
        )
    return Section(
        "Are the probabilities calibrated?",
        [
            words,
            Picture(
                trust_drawing(reliability, score.risk),
                "Left: named effects by the probability with which they were named, and the share "
                "of them that is true (bars: 90 % intervals). On the dashed line, the probability "
                "is right. Right: the share of wrong names, if only the names with the highest "
                "probabilities are believed.",
                "Reliability of the probabilities; risk over coverage",
            ),
            bins_table(reliability),
        ],
    )


def _sizes(score: Score) -> Section:
    return Section(
        "Sizes",
        [
            Picture(
                sizes_drawing(score.sizes),
                "Errors of the first parameter of each effect that was named and is in the "
                "machine.",
                "Errors of the sizes by effect",
            ),
            "The intervals of shares assume that the parameters of a record are independent.",
        ],
    )


def _plain_figures(caption: str, figures: Sequence[Figure]) -> Table:
    rows = [(figure.words, figure_text(figure)) for figure in figures]
    return Table(caption, ("figure", "value"), rows)


def _transfer(score: Score) -> Section:
    drawn = [promises for promises in score.promises if promises.each]
    blocks: list[Block] = [
        (
            "A wrong cause can shrink the gap on records that are similar to those to which it was "
            "fitted. Therefore a third record of the same machine, with another excitation, is "
            "simulated with the rig that the diagnosis found. The diagnosis never saw this record. "
            "A diagnosis does not write the calibrated rig; the found rig without its effects is "
            "used in its place. The realised shrinkage of the explainable gap is therefore, as a "
            "rule, stated too large."
        )
    ]
    if drawn:
        blocks.append(
            Picture(
                promises_drawing(drawn),
                "Each point is a record in which an effect was named; the lines are 90 % "
                "intervals.",
                "Realised over predicted shrinkage",
            )
        )
    else:
        blocks.append("No third record was kept, or nothing was named.")
    blocks += [
        _plain_figures(f"{promises.words.capitalize()}.", promises.figures) for promises in drawn
    ]
    regret = score.regret
    blocks.append(
        _plain_figures(
            "The regret is the held-out cost of the winner minus that of the true set, fitted in "
            "the same way: below zero the winner is better. The truth was among the candidates of "
            f"{regret.tried} records; in {regret.not_tried} records it was never fitted.",
            regret.figures,
        )
    )
    return Section("Does the predicted shrinkage hold on a third record?", blocks)


def _edits(score: Score) -> Section:
    """The edit test; the figures must differ between right names and others."""
    return Section(
        "Does the found rig follow when its causes are taken away?",
        [
            "Two more records of each machine with effects were withheld: after its effects were "
            "removed, and after they were halved. The named effects of the found rig are removed "
            "or halved as well, and nothing is fitted. With right names the rig leaves as little "
            "as before. A set of causes that compensate each other leaves more.",
            Picture(
                edits_drawing(score),
                "Each point is a machine for which effects were named. Below the dashed line the "
                "edited rig is better than the rig as found. Below the green line it leaves at "
                "most three times what it left before the change.",
                "Gap of the edited rig over that of the rig as found",
            ),
            *(_plain_figures(f"Effects {one.edit}.", one.figures) for one in score.edits),
        ],
    )


def _baselines(score: Score) -> Section:
    return Section(
        "Comparison with simpler methods and with chance",
        [
            (
                ". ".join(
                    f"{baseline.name[0].upper()}{baseline.name[1:]}: {baseline.how}"
                    for baseline in score.baselines
                )
                + "."
            ),
            baseline_table(score.baselines),
            *([control_table(score.controls)] if score.controls else []),
        ],
    )


def _wrong(score: Score) -> Section:
    if not score.wrong:
        return Section("What it gets wrong", ["Nothing in this check."])
    return Section("What it gets wrong", [wrong_table(score.wrong)])


def _contradictions(score: Score) -> Section:
    title = "Does a diagnosis contradict itself?"
    if not score.contradictions:
        return Section(title, ["No: all statements of each diagnosis agree with each other."])
    return Section(title, [contradiction_table(score.contradictions)])


def _how(score: Score) -> Section:
    blocks: list[Block] = [
        (
            "The records come from a generator that shares no integrator and no code with the "
            "simulator of the diagnosis. Of its equations one has a form that the simulator can "
            "have, too: the metering edge that closes where its rounding ends. The answers are in "
            "a file of their own, whose SHA-256 is written before the run. The diagnosis reads "
            "only the rig and the records. One table (module judging) decides what is right: all "
            "laws of friction count as one, and a set that contains the truth is right."
        )
    ]
    if score.seal is not None:
        state = "are those of the seal" if score.sealed else "are NOT those of the seal"
        blocks.append(f"The answers {state}, SHA-256 {score.seal.answers_sha256}.")
        rows = [(name, str(value)) for name, value in score.seal.settings.plain().items()]
        rows.append(("ehsid_version", score.seal.ehsid_version))
        blocks.append(Table("How the records were made.", ("setting", "value"), rows))
    return Section("How this was made", blocks)
