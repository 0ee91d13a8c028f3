# SPDX-License-Identifier: MIT
"""A table of texts, as terminals, notebooks and plain text show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Literal

from ..base.text import printable

# Colours of the reader's page, light or dark: the table adds lines and nothing else.
_CELL = "text-align:{};padding:2px 8px;border-bottom:1px solid rgba(128,128,128,0.35)"


@dataclass(frozen=True)
class TextTable:
    """A table of texts: the first column to the left, the others as `justify` says.

    Attributes
    ----------
    headings
        of the columns.
    rows
        each with one text for each column.
    title, caption
        above and below the table; "" for none.
    justify
        "right" for numbers, "left" for words.
    """

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""
    caption: str = ""
    justify: Literal["left", "right"] = "right"

    def text(self) -> str:
        """Returns the table as plain text."""
        lines = [tuple(map(_on_a_line, row)) for row in (self.headings, *self.rows)]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        shown = ["  ".join(map(self._aligned, range(len(line)), line, widths)) for line in lines]
        rule = "  ".join("-" * width for width in widths)
        parts = [_on_a_line(self.title), shown[0], rule, *shown[1:], _on_a_line(self.caption)]
        return "\n".join(part.rstrip() for part in parts if part)

    def _aligned(self, column: int, text: str, width: int) -> str:
        left = column == 0 or self.justify == "left"
        return text.ljust(width) if left else text.rjust(width)

    def html(self) -> str:
        """Returns the table as HTML; all texts are escaped."""
        head = self._row("th", self.headings)
        body = "".join(self._row("td", row) for row in self.rows)
        title = f"<caption>{_safe(self.title)}</caption>" if self.title else ""
        below = f"<p>{_safe(self.caption)}</p>" if self.caption else ""
        table = f"<table>{title}<thead>{head}</thead><tbody>{body}</tbody></table>"
        return table + below

    def _row(self, tag: str, texts: Sequence[str]) -> str:
        sides = ["left", *[self.justify] * (len(texts) - 1)]
        cells = "".join(
            f'<{tag} style="{_CELL.format(side)}">{_safe(text)}</{tag}>'
            for side, text in zip(sides, texts, strict=True)
        )
        return f"<tr>{cells}</tr>"


def _on_a_line(text: str) -> str:
    return printable(text).replace("\n", " ")


def _safe(text: str) -> str:
    return escape(printable(text))
