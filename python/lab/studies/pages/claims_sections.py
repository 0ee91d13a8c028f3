# SPDX-License-Identifier: MIT
"""Sections of the report with the verdict on each claim, and what is behind it."""

from __future__ import annotations

from collections.abc import Sequence

from ehsid.harness.show.page import Picture, Section, Table
from ehsid.harness.show.shares import percent

from ..experiment import RUNS_A_CELL, ClaimResults
from ..published import RECURSIVE
from ..verdicts import ClaimVerdict
from .claims_figures import reset_figure, start_figure


def verdict_lead(verdicts: Sequence[ClaimVerdict]) -> list[str]:
    """Returns one sentence for each claim: its verdict, and the shares where it holds and fails."""
    return [
        f"{verdict.claim}: {verdict.verdict.value} "
        f"({percent(verdict.holds)} of the conditions tried, the opposite in "
        f"{percent(verdict.fails)})."
        for verdict in verdicts
    ]


def claims_table(claims: ClaimResults) -> Table:
    """Returns the table of the verdicts, with one row for each claim."""
    return Table(
        "The paper's claims on the varying factor, Eq. (15), over all conditions of the maps: "
        "share of the conditions in which the claim holds, fails, or makes no difference; the rest "
        "is undecided or never arrives.",
        ("claim", "verdict", "holds", "fails", "no difference"),
        [
            (
                verdict.claim,
                verdict.verdict.value,
                percent(verdict.holds),
                percent(verdict.fails),
                percent(verdict.equal),
            )
            for verdict in claims.verdicts
        ],
    )


def claims_sections(claims: ClaimResults) -> list[Section]:
    """Returns the sections on verdicts, the start of lambda = 1, and the reset."""
    paper = ", ".join(f"{name}: {run.rmse:g}" for name, run in RECURSIVE.items())
    return [
        Section(
            "Do the claims hold?",
            [
                claims_table(claims),
                *(f"{verdict.claim}: {verdict.where()}." for verdict in claims.verdicts),
                (
                    "Faster: time until the parameter error stays below 5 %. Calmer: spread of the "
                    "estimate over the last quarter. RMSE: of the innovation over the whole run, "
                    f"against the better of the other two (the paper reports {paper}). The "
                    "recursion is the paper's own, without this estimator's guards. A cell of the "
                    f"map has {RUNS_A_CELL} paired runs; its colour follows the 95 % interval of "
                    "the median ratio, which claims.csv has for every condition."
                ),
            ],
        ),
        Section(
            "The start of lambda = 1",
            [
                (
                    "lambda = 1 never forgets its start. From a small P(0), that is a start at "
                    "theta = 0 that is trusted, an error is left after 100 s; from a vague start "
                    "lambda = 1 is as close as any. The paper's column for lambda = 1 is "
                    f"{percent(claims.error_of_one)} away from model (16). P(0) = "
                    f"{claims.start_of_one:.2g} I leaves as much at the noise of the published "
                    "fit, for an input of rms 1.5, but in other parameters, as the table for this "
                    "start shows: the start does not explain the column."
                ),
                Picture(
                    start_figure(claims.judged, claims.error_of_one),
                    "Error of lambda = 1 after 100 s over the start, median with its 95 % "
                    "interval, multisine.",
                    "Curves that fall from 100 % for small P0 to below 1 % for large P0",
                ),
            ],
        ),
        Section(
            "Where the reset helps",
            [
                Picture(
                    reset_figure(claims.resets),
                    "Varying factor from a vague start; all b change at 50 s. The reset fires "
                    "where the error of the prediction grows threefold.",
                    "Two maps over the size of the change and the noise",
                )
            ],
        ),
    ]
