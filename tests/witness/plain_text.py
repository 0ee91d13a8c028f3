# SPDX-License-Identifier: MIT
"""What a command wrote, as lines of text that are the same on every machine and at every time."""

from __future__ import annotations

import json
import re
import struct
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import scipy.io

WIDTH = 600  # of a line of JSON: a candidate of a diagnosis fits on one
LONGEST = 30  # list or table that is kept whole
# A number that may have been rounded; a C header has an F behind it.
NUMBER = re.compile(
    r"(?<![\w.])-?\d+(?:\.\d+(?:[eE][-+]?\d+)?|[eE][-+]\d+)(?!\.?\d|[A-EG-Za-eg-z_])"
)
# Sums, and what depends on the time that something took. Lengths of records stay.
TIME = r"time, (?:median|90th percentile)"
TIMED = {"seconds", "step_cycles", "bytes"}  # keys of JSON and columns
REMOVED = (
    (re.compile(r"\b[0-9a-f]{64}\b"), "<sha256>"),
    (re.compile(r"\d[\d.]* (?:s|min|h)\b(?= of one core)"), "<time>"),
    (re.compile(r"· [\d.]+ (?:s|min|h)$", re.MULTILINE), "· <time>"),
    # In a check, whether the time is within its target.
    (re.compile(rf"^(\W*{TIME}) \|.*$", re.MULTILINE), r"\1: <time>"),
    (re.compile(r"\d+ of \d+ targets\s+are\s+met\.(?:\s+Missed:[^.]*\.)?"), "<targets>"),
    # In the loop, samples a second and cycles of the emulator.
    (re.compile(r"\b\d+(?= a second|/s, fit)"), "<rate>"),
    (re.compile(r"(\| \d+ \| )\d+( (?:\| [\d /]+ ){5,}\| )\d+(?= \| same)"), r"\1<rate>\2<cycles>"),
)
# Lines of progress: which of them appear depends on the time that passes.
PROGRESS = re.compile(
    r"[\w ,.-]+: \d+ %(?:, about .* to go)?(?:; .*)?$"  # a stage
    r"|\d+ of \d+, .* (?:s|min|h)(?: left)?$"  # a case or a machine
)


def rounded(text: str, digits: int) -> str:
    """The text with its numbers of more than `digits` significant digits rounded."""

    def shorter(match: re.Match[str]) -> str:
        number = match.group()
        significant = re.split("[eE]", number)[0].replace(".", "").strip("-0")
        if len(significant) <= digits:
            return number
        short = f"{float(number):.{digits}g}"
        return short if "." in short or "e" in short else f"{short}.0"

    return NUMBER.sub(shorter, text)


def same(one: str, other: str, digits: int) -> bool:
    """Whether lines differ by rounding alone: in the last digit that is kept, or as 1e-16 does."""
    if one == other:
        return True
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(
        abs(x - y) <= 10.0 ** (np.floor(np.log10(max(abs(x), abs(y)))) - digits + 1.001)
        for x, y in ((float(x), float(y)) for x, y in pairs)
        if max(abs(x), abs(y)) > 1e-14 and x != y
    )


class Plain:
    """Takes out of texts and files what differs from run to run and from machine to machine."""

    def __init__(self, digits: int, names: dict[str, str]) -> None:
        self.digits = digits
        days = {time.strftime("%Y-%m-%d", when) for when in (time.gmtime(), time.localtime())}
        # The longest first: the name of a folder may begin with that of another.
        self._names = sorted(
            [*names.items(), *((day, "<today>") for day in days)], key=lambda pair: -len(pair[0])
        )

    def text(self, text: str) -> list[str]:
        """The lines that stand for a text: for JSON those of `file`."""
        for name, instead in self._names:
            text = text.replace(name, instead)
        for pattern, instead in REMOVED:
            text = pattern.sub(instead, text)
        if text.startswith("{"):
            text = "\n".join(_json_lines(_timeless(json.loads(text)), self.digits))
        lines = (line for line in text.splitlines() if not PROGRESS.match(line))
        return [rounded(line, self.digits).rstrip() for line in lines]

    def file(self, path: Path) -> list[str]:
        """The lines that stand for a file."""
        if path.suffix == ".png":
            width, height = struct.unpack(">II", path.read_bytes()[16:24])
            return [f"picture of {width} x {height} pixels"]
        if path.suffix in TABLES:
            return self.text("\n".join(_table_lines(TABLES[path.suffix](path), self.digits)))
        text = path.read_text(encoding="utf-8")
        return self.text("\n".join(_page_lines(text)) if path.suffix == ".html" else text)


def brief(lines: list[str]) -> list[str]:
    """For a file of a kind that stands elsewhere: how long it is, and a sum of all but numbers."""
    return [f"{len(lines)} lines, {_sum(NUMBER.sub('#', line) for line in lines)}"]


def _sum(lines: Iterable[str]) -> str:
    return f"sum x{zlib.crc32(chr(10).join(lines).encode()):08x}"


def _arrays(content: dict[str, Any]) -> pl.DataFrame:
    columns = {name: np.ravel(x) for name, x in content.items() if not name.startswith("__")}
    return pl.concat([pl.DataFrame({name: x}) for name, x in columns.items()], how="horizontal")


TABLES: dict[str, Callable[[Path], pl.DataFrame]] = {
    ".csv": lambda path: pl.read_csv(path, infer_schema_length=None),
    ".parquet": pl.read_parquet,
    ".npz": lambda path: _arrays(dict(np.load(path))),
    ".mat": lambda path: _arrays(scipy.io.loadmat(path)),
}


def _table_lines(table: pl.DataFrame, digits: int) -> Iterator[str]:
    """Size and names, all rows or the outer ones, and what stands for the values of a column."""
    table = table.with_columns(pl.lit("<time>").alias(x) for x in table.columns if x in TIMED)
    yield f"{table.height} rows: {', '.join(table.columns)}"
    rows = [", ".join(map(str, row)) for row in table.rows()]
    if table.height <= LONGEST:
        yield from rows
        return
    yield from (*rows[:2], "...", rows[-1])
    for column in table.iter_columns():
        yield f"{column.name} ({column.dtype}): {_column(column, digits)}"


def _column(column: pl.Series, digits: int) -> str:
    """Figures that change with each value and with the order, but hardly with a last digit."""
    if not column.dtype.is_numeric():
        return _sum(map(str, column.to_list()))
    values = column.cast(pl.Float64).fill_null(np.nan).to_numpy()
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "nothing finite"
    off = finite - finite.mean()
    spread = float(np.sqrt(np.mean(off**2)))
    turns = np.cos(2.399963 * np.arange(finite.size))  # the golden angle: no period of a signal
    mix = float(turns @ off) / (spread * np.sqrt(finite.size)) if spread else 0.0
    figures = (finite.min(), finite.max(), finite.mean(), spread)
    said = "from {} to {}, mean {}, deviation {}".format(*(f"{x:.{digits}g}" for x in figures))
    gaps = f", {values.size - finite.size} gaps" if finite.size < values.size else ""
    return f"{said}, mix {mix:.{digits - 1}f}{gaps}"


def _timeless(value: Any) -> Any:
    if isinstance(value, list):
        return [_timeless(item) for item in value]
    if not isinstance(value, dict):
        return value
    if re.match(TIME, str(value.get("words"))):
        return {"words": value["words"]}
    return {key: "<time>" if key in TIMED else _timeless(item) for key, item in value.items()}


def _json_lines(value: Any, digits: int, indent: str = "", key: str = "") -> Iterator[str]:
    """What fits on one line is on one line; of long lists the first item and a sum."""
    line = f"{indent}{key}{rounded(json.dumps(value, ensure_ascii=False), digits)}"
    if not isinstance(value, dict | list) or not value or len(line) <= WIDTH:
        yield line
    elif isinstance(value, dict):
        yield f"{indent}{key}{{"
        for name, item in value.items():
            yield from _json_lines(item, digits, indent + " ", f'"{name}": ')
        yield f"{indent}}}"
    else:
        items = [list(_json_lines(item, digits, indent + " ")) for item in value]
        whole = len(items) == 1 or (len(items) <= LONGEST and max(map(len, items)) == 1)
        yield f"{indent}{key}["
        for item in items if whole else items[:1]:
            yield from item
        if not whole:
            yield f"{indent} ... {len(items)} in all, {_sum(x for item in items for x in item)}"
        yield f"{indent}]"


class _Page(HTMLParser):
    """The words of a page: a line for a paragraph, a heading, an item, a row of a table."""

    INLINE = frozenset(("a", "abbr", "code", "em", "img", "small", "span", "strong", "sub", "sup"))
    CELLS = frozenset(("td", "th"))
    SILENT = frozenset(("script", "style", "svg", "title"))

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self._line = ""
        self._silent: list[str] = []  # the element that is not shown, and its like within it
        self._cell = False

    def end_line(self) -> None:
        line = " ".join(self._line.split()).removeprefix("| ")
        if line:
            self.lines.append(line)
        self._line = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if self._silent:
            self._silent += [tag] * (tag == self._silent[0])
        elif tag in self.SILENT or "hidden" in given:
            self._silent = [tag]
        elif tag == "img":
            self._line += f"[picture: {given.get('alt') or ''}]"
        elif tag in self.CELLS or given.get("role") in ("cell", "rowheader"):
            self._cell = tag in self.CELLS
            self._line += " | "
        elif not self._cell and tag not in self.INLINE:
            self.end_line()
            heading = re.fullmatch(r"h(\d)", tag)
            self._line = "- " if tag == "li" else "#" * int(heading[1]) + " " if heading else ""
        if "data-root-id" in given:
            self._line += "[plot]"

    def handle_endtag(self, tag: str) -> None:
        if self._silent:
            self._silent = self._silent[tag == self._silent[0] :]
        elif tag in self.CELLS:
            self._cell = False
        elif not self._cell and tag not in self.INLINE:
            self.end_line()

    def handle_data(self, data: str) -> None:
        if not self._silent:
            self._line += data


def _page_lines(text: str) -> list[str]:
    """The visible words of a page, and those of its plots."""
    page = _Page()
    page.feed(text)
    page.close()
    page.end_line()
    words = set(re.findall(r'"axis_label":"([^"]*)"', text))
    words |= set(re.findall(r'"label":\{"type":"value","value":"([^"]*)"', text))
    return [*page.lines, f"in plots: {', '.join(sorted(words))}"] if words else page.lines
