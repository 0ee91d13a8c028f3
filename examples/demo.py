# SPDX-License-Identifier: MIT
"""A first run: a real hydraulic record and the published model, as one page to look at.

python examples/demo.py [--out FOLDER] [--seeds N]
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from known_model import known_model_sections
from real_record import Part, real_record_section
from rich.progress import track

from ehsid.harness.experiment.published import SOURCE
from ehsid.harness.report.page import Page, write_page

PAGE = "demo.html"


def main(
    out: Annotated[Path, typer.Option(help="folder for the page")] = Path("build/demo"),
    seeds: Annotated[int, typer.Option(min=2, help="runs of each comparison")] = 100,
) -> None:
    """Write demo.html.

    Example: python examples/demo.py --out build/demo
    """
    parts: tuple[Callable[[], Part], ...] = (
        real_record_section,
        partial(known_model_sections, seeds),
    )
    done: list[Part] = [part() for part in track(parts, description="estimating")]
    sections = [section for found in done for section in found.sections]
    page = Page(
        title="ehsid: a hydraulic servo, identified while it runs",
        lead=[sentence for found in done for sentence in found.lead],
        sections=sections,
        sources=[
            SOURCE,
            "Crane record: S. Gunnarsson and P. Krus; benchmark in J. Sjöberg et al., "
            "Automatica 31(12), 1995, pp. 1691-1724",
        ],
    )
    write_page(out / PAGE, page)
    typer.echo(f"Open {(out / PAGE).resolve().as_uri()}")


if __name__ == "__main__":
    typer.run(main)
