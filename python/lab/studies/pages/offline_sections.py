# SPDX-License-Identifier: MIT
"""Sections of the report on the offline procedure, from the attempts to the closed loop."""

from __future__ import annotations

from collections.abc import Sequence

from ehsid.harness.models.identification import FrequencyResponse, Preprocessed
from ehsid.harness.show.model_blocks import loop_blocks
from ehsid.harness.show.page import Block, Section, Table

from ..attempts import Attempt
from ..procedure import Procedure
from ..rig_records import PublishedOrder
from .offline_model_blocks import (
    outputs_picture,
    poles_zeros_blocks,
    residual_picture,
    response_blocks,
)


def offline_sections(
    procedure: Procedure,
    *,
    record_name: str,
    published: Sequence[PublishedOrder] | None = None,
    rig_response: FrequencyResponse | None = None,
    with_outputs: bool = True,
) -> list[Section]:
    """Returns the sections on the attempts and the model of a record, or why there is no model.

    Parameters
    ----------
    procedure
        result of the offline procedure.
    record_name
        name of the record, for the headings.
    published
        rows of the paper's table of orders, for comparison.
    rig_response
        frequency response of the rig from command to output, in the units of the record, for
        comparison with the model.
    with_outputs
        whether to show measured and simulated output; False where the page begins with them.
    """
    problems = [f"{finding.problem.capitalize()}: {finding.text}" for finding in procedure.problems]
    if procedure.kept is None:
        title = f"Offline identification of {record_name}: not possible"
        return [Section(title, [*problems, procedure.stopped])]
    best = procedure.best
    first = procedure.attempts[0]
    sections = [
        Section(
            f"Offline identification of {record_name}",
            [
                *problems,
                _summary(procedure),
                *([outputs_picture(procedure)] if with_outputs else []),
                _attempt_table(procedure),
                *_attempt_words(procedure),
                procedure.stopped,
                *procedure.meaning,
            ],
        )
    ]
    if best.preprocessed is not None:
        sections.append(
            Section("Offline: pre-processing", _preprocessing(best.preprocessed, procedure))
        )
    if first.result is not None:
        sections.append(Section("Offline: order and delay", _orders(first, best, published)))
    if best.result is not None:
        sections.append(Section("Offline: validation", [residual_picture(best.result)]))
    if procedure.poles_zeros is not None:
        sections.append(
            Section("Offline: poles and zeros", poles_zeros_blocks(procedure.poles_zeros))
        )
    if procedure.response is not None:
        sections.append(
            Section("Offline: frequency response", response_blocks(procedure, rig_response))
        )
    if procedure.loop is not None:
        sections.append(
            Section(
                "Offline: proportional control",
                loop_blocks(procedure.loop, procedure.data.dt_s, procedure.input_band),
            )
        )
    return sections


def _summary(procedure: Procedure) -> str:
    best = procedure.best
    assert best.result is not None
    failed = ", ".join(best.failed_tests)
    return (
        f"Of {procedure.data.n_samples} samples the first {best.result.n_estimation} estimate, the "
        f"other {best.result.n_validation} judge. Kept: {best.result.chosen.orders}, one-step fit "
        f"{best.one_step_fit_percent:.2f} %, simulation fit {best.simulation_fit_percent:.2f} %; "
        + (f"residual tests that fail: {failed}." if failed else "no residual test fails.")
    )


def _attempt_table(procedure: Procedure) -> Table:
    rows = []
    for number, attempt in enumerate(procedure.attempts, start=1):
        if attempt.result is None:
            cells = [""] * 6
        else:
            tests = (attempt.result.whiteness, attempt.result.independence)
            cells = [
                str(attempt.result.chosen.orders.na),
                str(attempt.result.chosen.orders.nk),
                f"{attempt.one_step_fit_percent:.3f}",
                f"{attempt.simulation_fit_percent:.2f}",
                *(_outcome(attempt, test.passed) for test in tests),
            ]
        names = ", ".join(finding.problem for finding in attempt.problems) or "none"
        rows.append((f"{number}. {attempt.change}", *cells, names))
    return Table(
        "Attempts in order; the one that is kept is marked. Fits, one step ahead and simulated, "
        "are on the validation part, in the units of the record.",
        (
            "attempt",
            "order",
            "delay",
            "one-step %",
            "simulated %",
            "white",
            "independent",
            "problems",
        ),
        rows,
        marked=[] if procedure.kept is None else [procedure.kept],
    )


def _outcome(attempt: Attempt, passed: bool) -> str:
    return "nothing left" if attempt.exact else "yes" if passed else "no"


def _attempt_words(procedure: Procedure) -> list[str]:
    return [
        f"Attempt {number}, {attempt.change}: {attempt.why}. {_sentence(attempt)}"
        for number, attempt in enumerate(procedure.attempts, start=1)
        if number > 1
    ]


def _sentence(attempt: Attempt) -> str:
    problems = " ".join(finding.text for finding in attempt.problems)
    compared = attempt.comparison
    return f"{compared[:1].upper()}{compared[1:]}." + (f" {problems}" if problems else "")


def _preprocessing(done: Preprocessed, procedure: Procedure) -> list[Block]:
    dt_s = procedure.data.dt_s
    rows = [
        (
            signal.name,
            f"{signal.mean:.5g}",
            f"{signal.trend_per_sample / (dt_s or 1.0):.4g}",
            f"{signal.deviation:.4g}",
            f"{signal.level:.5g}",
            f"{signal.slope / (dt_s or 1.0):.4g}",
            f"{signal.scale:.4g}",
        )
        for signal in (done.u, done.y)
    ]
    per = "sample" if dt_s is None else "s"
    outliers = "not looked for" if done.outliers is None else done.outliers.text
    blocks: list[Block] = [
        f"Pre-processing of the attempt that was kept: {done.settings}.",
        Table(
            "Both signals in the estimation part, and what was done to all of the record.",
            (
                "signal",
                "mean",
                f"slope per {per}",
                "deviation",
                "level removed",
                "slope removed",
                "divided by",
            ),
            rows,
        ),
        f"Outliers of '{done.y.name}': {outliers}. The input is never touched.",
    ]
    if done.outliers is not None and done.outliers.positions.size:
        at = done.outliers.positions[:20]
        rest = done.outliers.positions.size - at.size
        names = ", ".join(str(int(k)) for k in at) + (f" and {rest} more" if rest else "")
        blocks.append(f"Samples replaced, counted from 0: {names}.")
    return [*blocks, done.consequence]


def _orders(
    first: Attempt, best: Attempt, published: Sequence[PublishedOrder] | None
) -> list[Block]:
    assert first.result is not None
    result = first.result
    theirs = {row.order: row for row in published or ()}
    rows = []
    for candidate in result.by_order:
        criteria = candidate.estimation
        row = [
            str(candidate.orders.na),
            str(candidate.orders.nk),
            f"{candidate.one_step_fit_percent:.3f}",
            f"{candidate.simulation_fit_percent:.2f}",
            f"{criteria.loss:.4g}",
            f"{criteria.fpe:.4g}",
            f"{criteria.aic:.3f}",
            f"{criteria.mdl:.4g}",
        ]
        if published is not None:
            paper = theirs.get(candidate.orders.na)
            row += (
                ["", "", ""]
                if paper is None
                else [f"{paper.fit_percent:.2f}", f"{paper.loss:.7f}", f"{paper.fpe:.7f}"]
            )
        rows.append(tuple(row))
    columns = [
        "order",
        "delay",
        "one-step %",
        "simulated %",
        "loss",
        "FPE",
        "AIC",
        "MDL",
    ]
    if published is not None:
        columns += ["paper: fit %", "loss", "FPE"]
    caption = (
        "Orders of the first attempt, each with its own delay; the chosen one is marked. Fits are "
        "on the validation part; loss, FPE, AIC and MDL are those of the data of the fit, in "
        "squared units of the output as pre-processed."
    )
    if published is not None:
        caption += (
            " The last three columns are the paper's, of its own rig and units; which fit is meant "
            "it does not say. They stand beside, not as a target."
        )
    chosen = [candidate.orders for candidate in result.by_order].index(result.chosen.orders)
    blocks: list[Block] = [
        Table(caption, columns, rows, marked=[chosen]),
        result.reason,
        result.delay_reason,
    ]
    blocks += [
        f"{rejected.orders} was not tried further: {rejected.why}."
        for rejected in result.rejected[:1]
    ]
    if best is not first and best.result is not None:
        blocks.append(
            f"The loop changed this choice: {best.result.chosen.orders} from the attempt "
            f"'{best.change}' is kept. {best.comparison[:1].upper()}{best.comparison[1:]}."
        )
    return blocks
