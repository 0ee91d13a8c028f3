# SPDX-License-Identifier: MIT
"""A first run as one page: a withheld effect found, a real hydraulic record, the published model.

python examples/demo.py [--out FOLDER] [--seeds N]
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from known_model import known_model_sections
from real_record import Part, real_record_section
from withheld_record import REPORT, Opening, withheld_record

from ehsid.harness.base.files import result_folder
from ehsid.harness.cli.progress import stages
from ehsid.harness.show.gap_page import gap_blocks, reason_blocks
from ehsid.harness.show.gap_words import SIMULATIONS, first_upper
from ehsid.harness.show.page import Page, Section
from ehsid.harness.show.rendering import write_page
from ehsid.harness.show.where_section import diagnosis_facts
from ehsid.lab.studies.rig_records import SOURCE

PAGE = "demo.html"


def demo_page(opening: Opening, others: Sequence[Part]) -> Page:
    """The page: the diagnosis first, as its report has it, and then the other parts."""
    diagnosis = opening.diagnosis
    sections = list(opening.sections)
    for part in others:
        first, *rest = part.sections
        sections += [Section(first.title, [*part.lead, *first.blocks]), *rest]
    return Page(
        title=first_upper(diagnosis.sentence),
        lead=[opening.lead],
        sections=[section for section in sections if section.blocks],
        sources=[
            SOURCE,
            "Crane record: S. Gunnarsson and P. Krus; benchmark in J. Sjöberg et al., "
            "Automatica 31(12), 1995, pp. 1691-1724",
        ],
        overline="ehsid: what the servo really is, and why the simulation disagrees with it",
        badge="An effect that was withheld",
        kind=diagnosis.verdict,
        summary=[
            diagnosis_facts(diagnosis),
            *gap_blocks(diagnosis, tuple(SIMULATIONS)),
            *reason_blocks(diagnosis),
        ],
        window_title="ehsid: a first run",
    )


def main(
    out: Annotated[Path, typer.Option(help="folder for the page")] = Path("build/demo"),
    seeds: Annotated[int, typer.Option(min=2, help="runs of each comparison")] = 100,
) -> None:
    """Write demo.html.

    Example: python examples/demo.py --out build/demo
    """
    with result_folder(out, "demo", [PAGE, f"{REPORT}/*"]) as folder:
        with stages() as report:
            opening = withheld_record(folder, lambda share: report("diagnosing", share))
            report("estimating", 0.0)
            record = real_record_section()
            report("estimating", 0.2)
            model = known_model_sections(seeds)
            report("estimating", 1.0)
        write_page(folder / PAGE, demo_page(opening, [record, model]))
    typer.echo(f"Open {(out / PAGE).resolve().as_uri()}")


if __name__ == "__main__":
    typer.run(main)
