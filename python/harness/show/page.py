# SPDX-License-Identifier: MIT
"""The one model of a page, a sequence of blocks, and its rendering as one offline HTML file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

import ehsid

from ..base.files import write_text
from ..base.text import printable
from .picture_data import embedded

if TYPE_CHECKING:
    from bokeh.plotting import figure as bokeh_figure

# A column is aligned to the right if its first cell with text begins with a number or is a dash. A
# word such as a checksum may begin with a digit.
NUMBER = re.compile(r"[-+−–±≤≥<>(]?\s*(?:\d[\d.,]*|\.\d+)(?:e[-+]?\d+)?(?!\w)|[-–]$")


@dataclass(frozen=True)
class Tagged:
    """A text with a highlighted tag in front or behind, and a hint that appears on hovering."""

    text: str
    tag: str = ""
    hint: str = ""


@dataclass(frozen=True)
class Bar:
    """A bar with its texts; `width`, and the ends `low` and `high` of its interval, in per cent."""

    label: str
    shown: str
    width: float
    kind: str = ""
    low: float | None = None
    high: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Mark:
    """An estimate and its interval on an axis, in per cent of the axis; None where not known."""

    at: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Scale:
    """The heading of a column of marks: texts at the left end, the middle and the right end."""

    left: str
    middle: str
    right: str


@dataclass(frozen=True)
class Link:
    """A text that leads to a file beside the page; `to` is its relative address."""

    text: str
    to: str


Cell = str | Tagged | Link | Bar | Mark


@dataclass(frozen=True)
class Fact:
    """An answer: the question in a word or two, the answer, and a sentence on it."""

    name: str
    value: str | Tagged
    note: str = ""


@dataclass(frozen=True)
class Facts:
    """The answers that a reader wants first, side by side."""

    facts: Sequence[Fact]


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Note:
    """A paragraph in small type, which a reader may skip."""

    text: str


@dataclass(frozen=True)
class Code:
    """Lines to be copied as they are, such as a command or an equation."""

    text: str


@dataclass(frozen=True)
class Items:
    """A list, numbered or with bullets."""

    items: Sequence[str | Tagged]
    numbered: bool = False


@dataclass(frozen=True)
class Table:
    """A table whose cells are finished text, tagged text, small bars or marks on an axis.

    Attributes
    ----------
    caption
        what the table shows; empty where the text above says it.
    columns
        headings of the columns; the first column holds the names of the rows.
    rows
        rows with one cell for each column.
    marked
        indices of the rows to highlight.
    """

    caption: str
    columns: Sequence[str | Scale]
    rows: Sequence[Sequence[Cell]]
    marked: Sequence[int] = ()

    def align(self, column: int) -> str:
        """Returns the CSS class of a column: "axis", "number" or "text"."""
        cells = [row[column] for row in self.rows if row[column] != ""]
        if cells and isinstance(cells[0], Mark):
            return "axis"
        first = cells[0] if cells else "0"
        text = first.text if isinstance(first, Tagged | Link) else first
        # Bars stand to the right with the numbers.
        return "text" if isinstance(text, str) and not NUMBER.match(text) else "number"


@dataclass(frozen=True)
class Bars:
    """Horizontal bars under each other; `label` describes them to readers who cannot see them."""

    label: str
    bars: Sequence[Bar]


@dataclass(frozen=True)
class Column:
    """A stretch of time as an upright bar; places and sizes in per cent of the axes."""

    left: float
    width: float
    height: float
    text: str


@dataclass(frozen=True)
class Timeline:
    """The upright bars of one record, and the start and the end of its time axis."""

    record: str
    label: str
    start: str
    end: str
    columns: Sequence[Column]


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, its caption, and an alternative text for readers who cannot see it."""

    figure: Figure
    caption: str
    alt: str


@dataclass(frozen=True, eq=False)
class Plot:
    """A plot that zooms. The page carries the samples and, once, the library that draws them."""

    figure: bokeh_figure


@dataclass(frozen=True, eq=False)
class Folded:
    """Blocks that the reader unfolds by a click on the title."""

    title: str
    blocks: Sequence[Block]
    unfolded: bool = False


@dataclass(frozen=True, eq=False)
class Card:
    """Blocks with a title and a frame."""

    title: str | Tagged
    blocks: Sequence[Block]


@dataclass(frozen=True, eq=False)
class Beside:
    """Groups of blocks that stand side by side where the window is wide enough."""

    groups: Sequence[Sequence[Block]]


# A plain text is a paragraph.
Block = (
    str
    | Heading
    | Note
    | Code
    | Items
    | Facts
    | Link
    | Table
    | Bars
    | Timeline
    | Picture
    | Plot
    | Folded
    | Card
    | Beside
)


@dataclass(frozen=True, eq=False)
class Section:
    """A heading and the blocks under it, in the order of the page."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True, eq=False)
class Page:
    """A whole page.

    Attributes
    ----------
    title
        heading of the page, in the box with the result.
    lead
        the result in a few sentences.
    sections
        sections in the order of the page.
    sources
        publications that the page uses.
    overline
        what the page is about, above the box.
    badge
        the kind of the result in a word or two.
    kind
        CSS class of the box: a verdict, for its colour.
    summary
        blocks between the box and the list of the sections: a picture of the result above all.
    footer
        texts for the last line, beside the version.
    window_title
        title of the browser's window; the heading if it is empty.
    """

    title: str
    lead: Sequence[Block]
    sections: Sequence[Section]
    sources: Sequence[str] = ()
    overline: str = ""
    badge: str = ""
    kind: str = ""
    summary: Sequence[Block] = ()
    footer: Sequence[str] = ()
    window_title: str = ""


def all_blocks(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yields all blocks, with those inside other blocks, in the order of the page."""
    for block in blocks:
        yield block
        if isinstance(block, Folded | Card):
            yield from all_blocks(block.blocks)
        elif isinstance(block, Beside):
            for group in block.groups:
                yield from all_blocks(group)


def render_page(page: Page) -> str:
    """Returns the HTML of a page, which needs no other files."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ehsid.harness.show"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"embedded": embedded, "kind": lambda block: type(block).__name__}
    contents = [*page.lead, *page.summary, *(b for part in page.sections for b in part.blocks)]
    plots = [block for block in all_blocks(contents) if isinstance(block, Plot)]
    library, script, places = _drawn(plots)
    return environment.get_template("page.html.j2").render(
        page=page,
        version=ehsid.__version__,
        library=library,
        script=script,
        places=dict(zip(plots, places, strict=True)),
    )


def _shown(value: Any) -> Any:
    """Returns what is put into a page: texts without control characters, finished HTML as it is."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return printable(value)
    return value


def _drawn(plots: Sequence[Plot]) -> tuple[str, str, Sequence[str]]:
    """Returns the HTML of the library, of the script that draws, and of the place of each plot."""
    if not plots:
        return "", "", []
    from bokeh.embed import components  # only pages with plots wait for bokeh
    from bokeh.resources import Resources

    script, places = components([plot.figure for plot in plots])
    # Not `render_js`: where Panel is imported, it would name files of Panel as well.
    parts = Resources(mode="inline", components=["bokeh"]).js_raw
    library = "\n".join(f'<script type="text/javascript">\n{part}\n</script>' for part in parts)
    return library, script, places


def write_page(path: Path, page: Page) -> None:
    """Writes the page, whole or not at all; its folder exists."""
    write_text(path, render_page(page))


def write_pictures(folder: Path, page: Page) -> list[Path]:
    """Writes every picture of the page as a PNG file, numbered and named after its section.

    Returns the paths in the order of the page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    titled = [("summary", page.summary), *((part.title, part.blocks) for part in page.sections)]
    for title, blocks in titled:
        slug = re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_")
        for block in all_blocks(blocks):
            if isinstance(block, Picture):
                path = folder / f"{len(written) + 1:02d}_{slug}.png"
                block.figure.savefig(path, dpi=110, format="png")
                written.append(path)
    return written
