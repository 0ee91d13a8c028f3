# SPDX-License-Identifier: MIT
"""Tells the decimal mark of a column of text from a mark between thousands."""

from __future__ import annotations

from dataclasses import dataclass

import polars as pl


@dataclass(frozen=True)
class Marks:
    """How the numbers of a column are written.

    Attributes
    ----------
    decimal
        "." or ",".
    thousands
        the mark between groups of three digits, or None.
    doubtful
        a number that can be read in two ways, or None.
    """

    decimal: str
    thousands: str | None = None
    doubtful: str | None = None

    def plain(self, text: pl.Series) -> pl.Series:
        """Returns the numbers with a decimal point; with a mark of neither use they stay text."""
        if self.thousands is not None:
            text = text.str.replace_all(self.thousands, "", literal=True)
        if self.decimal == ",":
            # A point would pass for the decimal one.
            text = text.str.replace_all(".", "?", literal=True)
            text = text.str.replace(",", ".", literal=True)
        return text


def marks_of(column: pl.Series, usual: str) -> Marks:
    """Returns the marks of a column in a file whose decimal mark is usually `usual`.

    "1.000" beside "999" or "1,5" is a thousand; where all cells are like "1.234", it may be both.
    """
    other = "." if usual == "," else ","
    text = column.drop_nulls().str.strip_chars()
    has_other = text.str.contains(other, literal=True)
    marked, rest = text.filter(has_other), text.filter(~has_other)
    if len(marked):
        if _all(marked, rf"[1-9]\d{{0,2}}(?:\{other}\d{{3}})+(?:\{usual}\d*)?"):
            several = marked.str.count_matches(other, literal=True).max() != 1
            sure = several or marked.str.contains(usual, literal=True).any()
            fewer = rest.filter(rest.str.contains(r"\d"))
            if (sure or len(fewer)) and _all(fewer, rf"\d{{1,3}}(?:\{usual}\d*)?"):
                return Marks(usual, other)
            return Marks(usual, doubtful=str(marked[0]))
        if not text.str.contains(usual, literal=True).any() and _all(
            marked, rf"(?:\d+\{other}\d*|\{other}\d+)(?:[eEdD][+-]?\d+)?"
        ):
            return Marks(other)
        return Marks(usual)
    has_usual = text.str.contains(usual, literal=True)
    marked, rest = text.filter(has_usual), text.filter(~has_usual)
    if (
        len(marked)
        and _all(marked, rf"[1-9]\d{{0,2}}(?:\{usual}\d{{3}})+")
        and _all(rest, r"\d{1,3}")
        and rest.str.contains(r"\d{3}").any()
    ):
        return Marks(other, usual)
    return Marks(usual)


def _all(cells: pl.Series, pattern: str) -> bool:
    return bool(cells.str.contains(rf"^[+-]?{pattern}$").all())
