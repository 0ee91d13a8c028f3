# SPDX-License-Identifier: MIT
"""A page of words, tables and pictures: one HTML file that works offline."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
import matplotlib as mpl
from matplotlib.figure import Figure

import ehsid
from ehsid.harness.files import replacing, write_text


@dataclass(frozen=True)
class Words:
    """A paragraph of plain text."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table of finished text.

    Attributes
    ----------
    caption
        what it shows.
    columns
        headings; the first column is read as the name of its row.
    rows
        one cell for each column.
    marked
        positions of rows to stand out.
    """

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    marked: Sequence[int] = ()


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, what it shows, and the same for those who cannot see it."""

    figure: Figure
    caption: str
    alt: str


@dataclass(frozen=True, eq=False)
class Section:
    """A heading and what stands under it, in order."""

    title: str
    blocks: Sequence[Words | Table | Picture]


@dataclass(frozen=True, eq=False)
class Page:
    """A whole page.

    Attributes
    ----------
    title
        heading.
    lead
        the result, in a few sentences.
    sections
        in order.
    sources
        works the page draws on.
    """

    title: str
    lead: Sequence[str]
    sections: Sequence[Section]
    sources: Sequence[str] = ()


def embedded(figure: Figure) -> str:
    """The figure as a data URI. SVG: sharp at every size, the same bytes for the same figure."""
    buffer = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "ehsid"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def render_page(page: Page) -> str:
    """HTML of a page, with everything inside."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ehsid.harness.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["words"] = lambda block: isinstance(block, Words)
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.filters["embedded"] = embedded
    return environment.get_template("page.html.j2").render(page=page, version=ehsid.__version__)


def write_page(path: Path, page: Page) -> None:
    """Write the page under a temporary name, then rename: a reader never sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, render_page(page))


def write_pictures(folder: Path, page: Page) -> list[Path]:
    """Every picture of the page as a PNG, numbered, named after its section."""
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for section in page.sections:
        slug = re.sub(r"[^a-z0-9]+", "_", section.title.lower()).strip("_")
        for block in section.blocks:
            if isinstance(block, Picture):
                path = folder / f"{len(written) + 1:02d}_{slug}.png"
                with replacing(path) as unfinished:
                    block.figure.savefig(unfinished, dpi=110, format="png")
                written.append(path)
    return written
