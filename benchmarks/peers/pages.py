# SPDX-License-Identifier: MIT
"""The page of a comparison, zoomable or as a document: the same sentences and tables for both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import charts
import msgspec
from measuring import EXCITED, FACTOR, FASTER, VARIANCE0, Plan
from python_peers import PEERS
from results import SHOWN_N, Results
from tables import (
    answer_table,
    error_table,
    goal_table,
    hold_table,
    late_error,
    levels,
    of,
    python_table,
    shown,
    size_table,
    small,
    time_table,
)

from ehsid.harness.show.page import Block, Page, Section, Table

COMMAND = "`python benchmarks/peers/run.py`"
LARGE = 0.01

# Published by others or measured earlier, on other machines: not to be compared digit by digit.
CITED = Table(
    "This run does not measure these figures. Others published them, or we measured them earlier "
    "on another machine.",
    ("what", "figure", "source"),
    (
        (
            "PX4 `ArxRls`, float, n = 5",
            "119 ns an update; no number after 1,968 held samples (lambda 0.99, noise 1e-3)",
            "measured earlier by us, on another x86 core at -O2",
        ),
        (
            "PX4, automatic tuning of multicopters",
            "5 to 20 s an axis; given up where the covariance has not converged in 20 s",
            "PX4 user guide, automatic tuning (pull request 1661 of PX4-user_guide)",
        ),
        (
            "PX4, the same on yaw in three simulated flights",
            "largest variance still above 1275 after 20 s, with a limit of 50",
            "issue 28704 of PX4-Autopilot",
        ),
        (
            "MATLAB `recursiveLS`, `recursiveARX`",
            "no time of an update is published; forgetting factor, Kalman filter and gradient",
            "https://www.mathworks.com/help/ident/ref/recursivels-system-object.html",
        ),
    ),
)

# Measured beside the run: instructions counted step by step, gcc 12 and clang 14 at -O2, float.
LIMITS = (
    "**Where a goal is not met**, the number of instructions limits an update, and not one that "
    "waits for another: two recursions side by side took 98 ns, one of them 45. With `Constant` "
    "gcc makes 680 instructions, of which 20 are divisions. Eq. (13) takes 305 of them, the "
    "account of information and what it decides about 125, Eq. (14) with its compensated sum "
    "and its checks 100, the statistics of the residuals 36. A user who does not need a part "
    "leaves it out: see the row without parts."
)
TRIED = (
    "**Tried and not kept**, because it brings less than it changes, on an AMD EPYC in a loop "
    "around one recursion. The account of information in turn, with numerators in each step and "
    "the division of one parameter, took 46.2 ns in place of 45.4 with gcc and `Constant`, 51.0 "
    "in place of 46.8 with `FRatio`, and 48.1 in place of 48.7 with clang and `Constant`. All "
    "its divisions in every sixth step took 43.6, 47.0 and 48.1 ns. The account divides in "
    "vectors already, so that two of the 20 divisions are saved, and the numerators would have "
    "to be kept, and saved in every snapshot. Without any account of new samples gcc took 40.4 "
    "ns. The 12 divisions of Eq. (13) in three vectors took 47.6 ns with gcc and 48.5 with "
    "clang.",
    "The goals for a Cortex-M (cycles, stack, the smallest estimator) are in `docs/budgets.md`, "
    "and what the bank takes is in `docs/evidence/bank.md`.",
)


@dataclass(frozen=True)
class Media:
    """Whether the charts are plots that zoom, or pictures."""

    zoomable: bool

    def shaped(self, block: Block) -> Block:
        """A block as this kind of page shows it."""
        return without_marks(block) if self.zoomable else block

    def times(self, results: Results) -> list[Block]:
        """Charts of the times."""
        if not self.zoomable:
            return [charts.time_picture(results)]
        ratios = [charts.ratio_plot(results, level) for level in levels(results)]
        return [charts.time_plot(results), *ratios]

    def errors(self, results: Results) -> list[Block]:
        """Charts of the errors in float."""
        cases = [(faster, factor) for faster in FASTER for factor in (1.0, FACTOR)]
        if self.zoomable:
            return [charts.error_plot(results, *case) for case in cases]
        return [charts.error_picture(results, *cases[2])]

    def holds(self, results: Results) -> list[Block]:
        """Chart of the held input."""
        return [charts.hold_plot(results)] if self.zoomable else []


def listed(names: Sequence[str]) -> str:
    """A list in a sentence; the names have commas."""
    return "; ".join(f"`{name}`" for name in names)


def without_marks(block: Block) -> Block:
    """A text or a table without the marks that Markdown has for code and bold words."""
    if isinstance(block, str):
        return block.replace("`", "").replace("**", "")
    if isinstance(block, Table):
        rows = [
            [cell.replace("`", "") if isinstance(cell, str) else cell for cell in row]
            for row in block.rows
        ]
        return msgspec.structs.replace(block, rows=rows)
    return block


def time_sentence(results: Results) -> str:
    """Where ours stand at n = 6."""
    level = levels(results)[0]
    ratios = {one.name.text: float(one.ratios()[1]) for one in of(results, level, SHOWN_N, "float")}
    ours = ratios["Rls, Constant"]
    faster = [name for name, ratio in ratios.items() if ratio < ours and "Rls" not in name]
    words = (
        f"In float with n = {SHOWN_N} at -O{level}, an update of `Rls` with `Constant` and all "
        f"guards takes {ours:.2f} times as long as the bare UD recursion in C, which has no guard. "
        f"With `FRatio` it takes {ratios['Rls, FRatio']:.2f} times as long. A whole step of "
        "`ArxEstimator` with `FRatio` takes "
        f"{ratios['ArxEstimator::step, FRatio']:.2f} times as long."
    )
    return words + (
        " These recursions are faster than `Rls` with `Constant`, and none of them has a guard: "
        f"{listed(faster)}."
        if faster
        else ""
    )


def error_sentence(results: Results) -> str:
    """Who loses float."""
    fails = sorted({one.name.text for one in results.errors if not late_error(one) <= LARGE})
    ours = max(late_error(one) for one in results.errors if one.name.ours)
    return (
        "In at least one of the four runs, these recursions have errors above 1 % or parameters "
        f"that are not numbers: {listed(fails)}. "
        if fails
        else "No recursion is off by more than 1 %. "
    ) + f"The largest error of the recursions of ehsid is {ours:.1e}."


def hold_sentence(results: Results) -> str:
    """Who survives a held input."""
    others = [one for one in results.holds if not one.name.ours]
    ours = [one for one in results.holds if one.name.ours]
    moved = [one for one in others if any(value is not None for value in one.moved)]
    last = max((value for one in moved for value in one.moved if value is not None), default=0)
    lost = [one for one in others if any(value is not None for value in one.not_finite)]
    own = [one for one in ours if any(value is not None for value in (*one.moved, *one.not_finite))]
    words = (
        f"In {len(moved)} of the {len(others)} recursions of others, a parameter has moved by 1 % "
        f"within {last:,} held samples. {len(lost)} of them end with parameters that are not "
        "numbers. "
    )
    held = min(one.held for one in ours)
    return words + (
        f"In {len(own)} of the {len(ours)} recursions of ehsid, a parameter has moved by 1 %: "
        f"{listed(sorted({one.name.text for one in own}))}."
        if own
        else f"No parameter of the {len(ours)} recursions of ehsid has moved by 1 % in {held:,} "
        "samples."
    )


def answer_sentence(results: Results) -> str:
    """Who is wrong."""
    wrong = [one for one in results.answers if not one.own and not one.right]
    same = [one for one in results.answers if not one.own and one.right]
    words = f"{len(same)} recursions find the parameters of batch least squares"
    if not wrong:
        return f"{words}; none is off by more than rounding."
    names = sorted(f"`{shown(one.name)}` by {small(one.deviation)}" for one in wrong)
    return f"{words}. These are off by more than rounding: {'; '.join(names)}."


def make_page(results: Results, plan: Plan, media: Media, bank: Table | None = None) -> Page:
    """The whole page."""
    flags = ", ".join(f"-O{level}" for level in levels(results))
    how = (
        f"**How it was measured.** {COMMAND} makes this page. It builds every recursion, checks "
        f"its answer and measures it. The compiler flags are {flags}, each with -ffp-contract=off "
        "and -DNDEBUG; the libraries are as packaged. All recursions in C and C++ run in one "
        f"process and take turns, in {plan.passes} passes of {plan.samples:,} samples. All get the "
        f"same samples, the forgetting factor {FACTOR:g} and P0 = {VARIANCE0:g} I. The machine and "
        f"the versions are: `{results.machine[0]}`; {'; '.join(results.machine[1:])}."
    )
    first, *charts = media.times(results)
    times: list[Block] = [
        "The bare UD recursion is Bierman's, in plain C and without any check. No recursion on "
        "factors can do less. A ratio is taken between passes that follow each other, so other "
        "load on the machine changes it little. The shortest time depends on the machine.",
        goal_table(results),
        LIMITS,
        *TRIED,
        *charts,
        time_table(results),
        size_table(results),
        python_table(results),
        *(f"`{peer.name}` {peer.note}." for peer in PEERS if peer.note),
        *([bank] if bank is not None else []),
        "An update of liquid-dsp includes n pushes into its window, because it is an equaliser. "
        "dlib calls the BLAS that its package was built for. `ArxEstimator::step` also makes "
        "the regressor from command and position, and runs the reset and the monitors of "
        "convergence and whiteness.",
    ]
    answers: list[Block] = [
        answer_sentence(results),
        "**The truth** is weighted batch least squares in float64, with the P0 from which each "
        "recursion starts.",
        "**The tolerance** is 4 n u sqrt(M) times the condition number of the information matrix, "
        "with the unit roundoff u and the memory M = 1 / (1 - lambda). It allows for rounding "
        "errors that are independent from sample to sample.",
        "**The policies of ehsid** other than `Constant` choose the weights of the samples "
        "themselves, so their answer differs. They are compared with papers in "
        "`tests/python/core/test_rls.py`.",
        "**Beyond the tolerance** there are three causes. K (P phi)' keeps the part of P that "
        "rounding made asymmetric, and this part grows by 1 / lambda in each sample. The "
        "regularisation of dlib enters P but not the update of the parameters, so dlib does not "
        "quite solve the problem that it documents. statsmodels starts from an infinite P0, where "
        "the first regressors are divided by differences that are almost zero.",
        answer_table(results),
    ]
    errors: list[Block] = [
        error_sentence(results),
        "The runs use model (16) of Ghazali et al. (2011) with a random binary command and a noise "
        f"of 1e-3, and the same servo sampled {FASTER[-1]} times as fast. Each run has "
        f"{plan.accurate:,} samples. A line of the chart ends where a parameter is not a number.",
        *media.errors(results),
        error_table(results.errors),
    ]
    holds: list[Block] = [
        hold_sentence(results),
        "The runs use model (16) with a noise of 1e-3. The command is random and binary for "
        f"{EXCITED:,} samples, and then stays at 0.5. A recursion that survives is stopped after "
        f"{plan.held:,} samples in C++, and after {plan.python_held:,} in Python. The table has "
        f"the median of {plan.seeds} seeds.",
        *media.holds(results),
        hold_table(results.holds),
    ]
    lead: list[Block] = [
        "This page compares an update of the estimator with those of other libraries. It is for "
        "you if you choose a recursion for a controller, or want to know what the guards of ehsid "
        "cost. A held input is a command that stays constant.",
        f"**Time.** {time_sentence(results)}",
        f"**Accuracy in float.** {error_sentence(results)}",
        f"**A held input.** {hold_sentence(results)}",
        how,
    ]
    sections: dict[str, list[Block]] = {
        "Time of an update": times,
        "The same answer": answers,
        "Accuracy in float": errors,
        "A held input": holds,
        "Figures of others": [CITED],
    }
    return Page(
        "An update beside those of others",
        [media.shaped(block) for block in lead],
        [Section(title, [*map(media.shaped, blocks)]) for title, blocks in sections.items()],
        summary=[first],
    )
