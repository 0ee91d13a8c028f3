# SPDX-License-Identifier: MIT
"""A first run as one page: a withheld effect found, a real hydraulic record, the published model.

python examples/demo.py [--out FOLDER] [--seeds N]
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from known_model import known_model_sections
from real_record import real_record_section
from withheld_record import REPORT, withheld_record_sections

from ehsid.harness.cli.progress import stages
from ehsid.harness.files import result_folder
from ehsid.harness.report.page import Page, write_page
from ehsid.harness.studies.published import SOURCE

PAGE = "demo.html"


def main(
    out: Annotated[Path, typer.Option(help="folder for the page")] = Path("build/demo"),
    seeds: Annotated[int, typer.Option(min=2, help="runs of each comparison")] = 100,
) -> None:
    """Write demo.html.

    Example: python examples/demo.py --out build/demo
    """
    with result_folder(out, "demo", [PAGE, f"{REPORT}/*"]) as folder:
        with stages() as report:
            done = [withheld_record_sections(folder, lambda share: report("diagnosing", share))]
            report("estimating", 0.0)
            done.append(real_record_section())
            report("estimating", 0.2)
            done.append(known_model_sections(seeds))
            report("estimating", 1.0)
        sections = [section for found in done for section in found.sections]
        page = Page(
            title="ehsid: what the servo really is, and why the simulation disagrees with it",
            lead=[sentence for found in done for sentence in found.lead],
            sections=sections,
            sources=[
                SOURCE,
                "Crane record: S. Gunnarsson and P. Krus; benchmark in J. Sjöberg et al., "
                "Automatica 31(12), 1995, pp. 1691-1724",
            ],
        )
        write_page(folder / PAGE, page)
    typer.echo(f"Open {(out / PAGE).resolve().as_uri()}")


if __name__ == "__main__":
    typer.run(main)
