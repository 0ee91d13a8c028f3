# SPDX-License-Identifier: MIT
"""Renders a page of paragraphs, tables and pictures as one HTML file that works offline."""

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
from ehsid.harness.files import write_text


@dataclass(frozen=True)
class Words:
    """A paragraph of plain text."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table whose cells are finished text.

    Attributes
    ----------
    caption
        what the table shows.
    columns
        headings of the columns; the first column holds the names of the rows.
    rows
        rows with one cell for each column.
    marked
        indices of the rows to highlight.
    """

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    marked: Sequence[int] = ()


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, its caption, and an alternative text for readers who cannot see it."""

    figure: Figure
    caption: str
    alt: str


@dataclass(frozen=True, eq=False)
class Section:
    """A heading and the blocks under it, in the order of the page."""

    title: str
    blocks: Sequence[Words | Table | Picture]


@dataclass(frozen=True, eq=False)
class Page:
    """A whole page.

    Attributes
    ----------
    title
        heading of the page.
    lead
        the result in a few sentences.
    sections
        sections in the order of the page.
    sources
        publications that the page uses.
    """

    title: str
    lead: Sequence[str]
    sections: Sequence[Section]
    sources: Sequence[str] = ()


def embedded(figure: Figure) -> str:
    """Returns a figure as a data URI with an SVG image.

    SVG is sharp at every size; the same figure always gives the same bytes.
    """
    buffer = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "ehsid"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def render_page(page: Page) -> str:
    """Returns the HTML of a page, which needs no other files."""
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
    """Writes the page, whole or not at all; its folder exists."""
    write_text(path, render_page(page))


def write_pictures(folder: Path, page: Page) -> list[Path]:
    """Writes every picture of the page as a PNG file, numbered and named after its section.

    Returns the paths in the order of the page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for section in page.sections:
        slug = re.sub(r"[^a-z0-9]+", "_", section.title.lower()).strip("_")
        for block in section.blocks:
            if isinstance(block, Picture):
                path = folder / f"{len(written) + 1:02d}_{slug}.png"
                block.figure.savefig(path, dpi=110, format="png")
                written.append(path)
    return written
