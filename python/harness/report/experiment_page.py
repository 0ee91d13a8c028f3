# SPDX-License-Identifier: MIT
"""The report of the experiment as one page, and its pictures as files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ehsid.harness.experiment.experiment import RecordFindings
from ehsid.harness.experiment.published import SOURCE
from ehsid.harness.experiment.summary import summarise
from ehsid.harness.experiment.verdicts import ClaimVerdict
from ehsid.harness.report.comparison_figures import error_figure
from ehsid.harness.report.page import Page, Picture, Section, Table, Words
from ehsid.harness.report.recursive_sections import (
    SPEED_CAPTION,
    reading_section,
    speed_table,
)


def verdict_lead(verdicts: Sequence[ClaimVerdict]) -> list[str]:
    """One sentence a claim."""
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
    """Everything on one page."""
    return Page(
        title=title,
        lead=list(lead),
        sections=list(sections),
        sources=[SOURCE],
    )


def record_sections(found: RecordFindings, dt_s: float | None, name: str) -> list[Section]:
    """The recursive half on a user's own record."""
    blocks: list[Words | Table | Picture] = [
        Words(
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
            Words(f"P(0) = {run.p0:.2g} I:"),
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


def write_pictures(folder: Path, page: Page) -> list[Path]:
    """Every picture of the page as a PNG, numbered, named after its section."""
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for section in page.sections:
        slug = re.sub(r"[^a-z0-9]+", "_", section.title.lower()).strip("_")
        for block in section.blocks:
            if isinstance(block, Picture):
                path = folder / f"{len(written) + 1:02d}_{slug}.png"
                unfinished = path.with_name(f".{path.name}.part")
                block.figure.savefig(unfinished, dpi=110, format="png")
                unfinished.replace(path)
                written.append(path)
    return written
