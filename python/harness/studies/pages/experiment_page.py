# SPDX-License-Identifier: MIT
"""Builds the report of the experiment as one page."""

from __future__ import annotations

from collections.abc import Sequence

from ehsid.harness.report.page import Block, Page, Picture, Section
from ehsid.harness.studies.experiment import RecordFindings
from ehsid.harness.studies.pages.comparison_figures import error_figure
from ehsid.harness.studies.pages.recursive_sections import (
    SPEED_CAPTION,
    reading_section,
    speed_table,
)
from ehsid.harness.studies.published import SOURCE
from ehsid.harness.studies.summary import summarise
from ehsid.harness.studies.verdicts import ClaimVerdict


def verdict_lead(verdicts: Sequence[ClaimVerdict]) -> list[str]:
    """Returns one sentence for each claim: its verdict, and the shares where it holds and fails."""
    return [
        f"{verdict.claim}: {verdict.verdict.value} "
        f"({100.0 * verdict.holds:.0f} % of the conditions tried, the opposite in "
        f"{100.0 * verdict.fails:.0f} %)."
        for verdict in verdicts
    ]


def experiment_page(
    lead: Sequence[str],
    sections: Sequence[Section],
    title: str = "The published experiment, redone",
) -> Page:
    """Returns the page with the lead, all sections and the source of the experiment."""
    return Page(
        title=title,
        lead=list(lead),
        sections=list(sections),
        sources=[SOURCE],
    )


def record_sections(found: RecordFindings, dt_s: float | None, name: str) -> list[Section]:
    """Returns the sections on the recursive estimates from a user's own record."""
    blocks: list[Block] = [
        (
            f"All contenders on {name}, once; the reference is the offline model above, so that "
            "what they reach is agreement with it, not truth."
        )
    ]
    step = 1.0 if dt_s is None else dt_s
    unit = "samples" if dt_s is None else "s"
    for run in found.runs:
        length = next(iter(run.outcomes.values())).error.shape[1] * step
        times = tuple(round(share * length, 3) for share in (0.05, 0.2, 0.5, 1.0))
        summaries = {n: summarise(o, step, times) for n, o in run.outcomes.items()}
        blocks += [
            f"P(0) = {run.p0:.2g} I:",
            Picture(
                error_figure(run.outcomes, step),
                "Distance of the parameters from the offline model; below, the forgetting factor.",
                f"Curves of the parameter error over the record, P0 = {run.p0:.2g}",
            ),
            speed_table(summaries, SPEED_CAPTION.replace(", median of the runs", ""), unit),
        ]
    sections = [Section("Recursive, on the record", blocks)]
    if found.reading is not None:
        sections.append(reading_section(found.reading, found.rig_reading, found.sampled))
    return sections
