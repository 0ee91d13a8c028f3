# SPDX-License-Identifier: MIT
"""The one model of what is shown, a sequence of blocks; `rendering` makes HTML and text of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from bokeh.plotting import figure as bokeh_figure
    from matplotlib.figure import Figure

# A column is aligned to the right if at least half of its cells with text begin with a number or
# are a dash. A word such as a checksum may begin with a digit.
NUMBER = re.compile(r"[-+−–±≤≥<>(]?\s*(?:\d[\d.,]*|\.\d+)(?:e[-+]?\d+)?(?!\w)|[-–]$")


# Between a number and its unit, where a heading or a sentence must not break.
SPACE = "\N{NO-BREAK SPACE}"
AT_UNIT = re.compile(
    r"(?<=\d) (?=(?:%|[mu]?[msV]|[kM]?[NW]|[kM]?Pa|k?Hz|bar|kg|l/min|m?m/s|rad/s)(?![\w/]))"
)


def whole(text: str) -> str:
    """Returns a text whose numbers stay on one line with their units."""
    return AT_UNIT.sub(SPACE, text)


class Tagged(msgspec.Struct, frozen=True, tag=True):
    """A text with a highlighted tag behind it, and a hint that appears on hovering.

    `kind` is "good", "bad" or "soft", for the colour of the text; "" has none.
    """

    text: str
    tag: str = ""
    hint: str = ""
    kind: str = ""


class Bar(msgspec.Struct, frozen=True, tag=True):
    """A bar with its texts; `width`, and the ends `low` and `high` of its interval, in per cent."""

    label: str
    shown: str
    width: float
    kind: str = ""
    low: float | None = None
    high: float | None = None
    note: str = ""


class Mark(msgspec.Struct, frozen=True, tag=True):
    """An estimate and its interval on an axis, in per cent of the axis; None where not known."""

    at: float | None
    low: float | None
    high: float | None


class Scale(msgspec.Struct, frozen=True, tag=True):
    """The heading of a column of marks: texts at the left end, the middle and the right end."""

    left: str
    middle: str
    right: str


class Link(msgspec.Struct, frozen=True, tag=True):
    """A text that leads to a file beside the page; `to` is its relative address."""

    text: str
    to: str


Cell = str | Tagged | Link | Bar | Mark


class Fact(msgspec.Struct, frozen=True, tag=True):
    """An answer: the question in a word or two, the answer, and a sentence on it."""

    name: str
    value: str | Tagged
    note: str = ""


class Facts(msgspec.Struct, frozen=True, tag=True):
    """The answers that a reader wants first, side by side."""

    facts: Sequence[Fact]


class Heading(msgspec.Struct, frozen=True, tag=True):
    """A heading inside a section."""

    text: str


class Note(msgspec.Struct, frozen=True, tag=True):
    """A paragraph in small type, which a reader may skip."""

    text: str


class Code(msgspec.Struct, frozen=True, tag=True):
    """Lines to be copied as they are, such as a command or an equation."""

    text: str


class Items(msgspec.Struct, frozen=True, tag=True):
    """A list, numbered or with bullets."""

    items: Sequence[str | Tagged]
    numbered: bool = False


class Table(msgspec.Struct, frozen=True, tag=True):
    """A table whose cells are finished text, tagged text, small bars or marks on an axis."""

    caption: str
    """What the table shows; empty where the text above says it."""
    columns: Sequence[str | Scale]
    """Headings of the columns; the first column holds the names of the rows."""
    rows: Sequence[Sequence[Cell]]
    """Rows with one cell for each column."""
    marked: Sequence[int] = ()
    """Indices of the rows to highlight."""
    note: str = ""
    """What is to be known of the numbers, below the table."""

    def align(self, column: int) -> str:
        """Returns the CSS class of a column: "axis", "number" or "text"."""
        cells = [row[column] for row in self.rows if row[column] != ""]
        if cells and isinstance(cells[0], Mark):
            return "axis"
        numbers = [isinstance(one, Bar) or bool(NUMBER.match(cell_text(one))) for one in cells]
        # A word among numbers says why there is none. Bars stand to the right with the numbers.
        return "number" if 2 * sum(numbers) >= len(numbers) else "text"


def cell_text(cell: Cell) -> str:
    """Returns the text of a cell or a heading without its tag; a mark has none."""
    if isinstance(cell, str):
        return cell
    return cell.shown if isinstance(cell, Bar) else "" if isinstance(cell, Mark) else cell.text


class Bars(msgspec.Struct, frozen=True, tag=True):
    """Horizontal bars under each other; `label` describes them to readers who cannot see them."""

    label: str
    bars: Sequence[Bar]


class Column(msgspec.Struct, frozen=True, tag=True):
    """A stretch of time as an upright bar; places and sizes in per cent of the axes."""

    left: float
    width: float
    height: float
    text: str


class Timeline(msgspec.Struct, frozen=True, tag=True):
    """The upright bars of one record, and the start and the end of its time axis."""

    record: str
    label: str
    start: str
    end: str
    columns: Sequence[Column]


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, its caption, and an alternative text for readers who cannot see it.

    With `frames` the page shows them one after the other, and then the figure.
    """

    figure: Figure
    caption: str
    alt: str
    frames: Sequence[Figure] = ()


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


# A plain text is a paragraph. What has only texts and numbers can be kept as JSON.
Told = str | Heading | Note | Items | Table
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
    """A whole page."""

    title: str
    """Heading of the page, in the box with the result."""
    lead: Sequence[Block]
    """The result in a few sentences."""
    sections: Sequence[Section]
    """Sections in the order of the page."""
    sources: Sequence[str] = ()
    """Publications that the page uses."""
    overline: str = ""
    """What the page is about, above the box."""
    badge: str = ""
    """The kind of the result in a word or two."""
    kind: str = ""
    """CSS class of the box: a verdict, for its colour."""
    summary: Sequence[Block] = ()
    """Blocks between the box and the list of the sections: a picture of the result above all."""
    footer: Sequence[str] = ()
    """Texts for the last line, beside the version."""
    window_title: str = ""
    """Title of the browser's window; the heading if it is empty."""


def all_blocks(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yields all blocks, with those inside other blocks, in the order of the page."""
    for block in blocks:
        yield block
        if isinstance(block, Folded | Card):
            yield from all_blocks(block.blocks)
        elif isinstance(block, Beside):
            for group in block.groups:
                yield from all_blocks(group)
