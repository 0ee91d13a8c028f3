# SPDX-License-Identifier: MIT
"""A first run as one page: a servo with a hidden effect that is found, and two real machines.

python examples/demo.py [--out FOLDER]
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from real_record import crane_section, press_section
from withheld_record import (
    DIAGNOSED_S,
    REPORT,
    Found,
    answer_section,
    found_in_records,
    largest_errors_mm,
    position_figure,
)

from ehsid.harness.base.files import result_folder
from ehsid.harness.cli.progress import stages
from ehsid.harness.show.gap_plots import gap_bars
from ehsid.harness.show.page import Bars, Block, Heading, Note, Page, Picture, Section
from ehsid.harness.show.rendering import write_page
from ehsid.harness.show.where_section import diagnosis_facts

PAGE = "demo.html"


def demo_page(found: Found, sections: Sequence[Section]) -> Page:
    """The page: what ehsid is, one picture, the verdict; then the sections."""
    diagnosis = found.diagnosis
    before, after = largest_errors_mm(found)
    summary: list[Block] = [
        Picture(
            position_figure(found),
            "A record that was not fitted. Both simulations know its command and where it "
            f"starts, nothing else. Largest error: {before:.1f} mm before, {after:.1f} mm after.",
            "The simulation before drifts away from the measured position, the one after stays "
            "on it",
        ),
        Heading("What ehsid says of it"),
        diagnosis.sentence,
        diagnosis_facts(diagnosis),
    ]
    if diagnosis.how_far is not None:
        summary += [
            Heading("Error of the simulation"),
            Bars("error before and after", gap_bars(diagnosis.how_far, ("nominal", "augmented"))),
            Note(
                "As a share of how much position and pressures move, over half a second each, on "
                "the record that was not fitted. Nothing can be better than the noise floor: what "
                "the sensors themselves do not repeat."
            ),
        ]
    return Page(
        title="ehsid finds what the simulation of a hydraulic axis lacks",
        lead=[
            "It is for engineers who build, tune or look after hydraulic axes: a cylinder "
            "that a valve moves and that follows a command. It needs a log of the machine and "
            "the values of its name plate. It answers: which physical effect is missing in the "
            "simulation, how large is it, and what do I do next? Its estimator says the same of "
            "gain and damping while the machine runs, inside of the controller.",
            "Here is an example. The machine has an effect that neither its file of values nor "
            f"ehsid was told of. From {DIAGNOSED_S:g} seconds of motion ehsid found it:",
        ],
        summary=summary,
        sections=sections,
        sources=[
            "Press: M. Quiroz, D. Maurel, vRTHS_AMBC_MRdamper, 2022 (MIT licence)",
            "Crane: S. Gunnarsson and P. Krus; benchmark in J. Sjöberg et al., "
            "Automatica 31(12), 1995, pp. 1691-1724",
        ],
        overline="ehsid: a first run",
        window_title="ehsid: a first run",
    )


def main(
    out: Annotated[Path, typer.Option(help="folder for the page")] = Path("build/demo"),
) -> None:
    """Write demo.html.

    Example: python examples/demo.py --out build/demo
    """
    with result_folder(out, "demo", [PAGE, f"{REPORT}/*"]) as folder:
        with stages() as report:
            found = found_in_records(folder, lambda share: report("diagnosing", share))
            report("identifying", 0.0)
            sections = [answer_section(found.diagnosis), press_section(), crane_section()]
            report("identifying", 1.0)
        write_page(folder / PAGE, demo_page(found, sections))
    typer.echo(f"Open {(out / PAGE).resolve().as_uri()}")


if __name__ == "__main__":
    typer.run(main)
