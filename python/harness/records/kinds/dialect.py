# SPDX-License-Identifier: MIT
"""Finds out how a text file of numbers is laid out: delimiter, decimal mark, header, first row.

And which rows at its end are no samples: an unfinished one, sums and means.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from ...catalogue.channels import CHANNELS
from ..names import means
from ..units import looks_like_a_unit
from ..values import EMPTY, WITH_PREFIX

SAMPLE_LINES = 400  # header blocks of loggers are shorter than half of these
DELIMITERS = ("\t", ";", "|", ",", " ")  # in the order in which they win a tie
SURE_ROWS = 3
LEAST_SCORE = 0.6  # share of cells of the data that are numbers or dates

_NUMBER = {
    ".": re.compile(
        r"[+-]?(?:[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?|(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?)"
    ),
    ",": re.compile(r"[+-]?(?:[1-9]\d{0,2}(?:\.\d{3})+(?:,\d+)?|\d+(?:,\d+)?(?:[eEdD][+-]?\d+)?)"),
}
_DATE = re.compile(
    r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{2,4}(?:[ T]+\d{1,2}:\d{2}.*)?"
    r"|\d{1,2}:\d{2}(?::\d{2})?(?:[.,:]\d+)?(?:\s*[APap][Mm])?)"
)
_RATE = re.compile(
    r"(?:sampl\w*|scan|abtast)\W*(?:rate|freq\w*)?[^0-9;,=:]*[;,=:\s]\s*([\d.]+)\s*(k?)Hz\b", re.I
)
_RATE_NAME = re.compile(
    r"(?:sampl\w*|scan)[\s_]*(?:rate|freq\w*)\W*?(?:\(?Hz\)?)?\W*([\d.]+(?:e[+-]?\d+)?)\s*$", re.I
)
_STEP_NAME = re.compile(
    r"(?:(?:sampl\w*|scan)[\s_]*(?:interval|period|time)|delta[\s_]?[xt]|dt|abtastzeit|schrittweite)"
    r"\W*?(?:\(?s\)?)?\W*([\d.]+(?:e[+-]?\d+)?)\s*(ms|s)?\s*$",
    re.I,
)

# So many rows with the same number of decimals are taken for a fixed form of numbers.
ROWS_OF_ONE_FORM = 50
# Rows of results below a table are fewer.
MOST_RESULTS = 12
_WORDS = """
sum summe total gesamt somme suma somma mean mittel mittelwert average avg durchschnitt moyenne
promedio median min minimum max maximum std stdev stddev stdabw standardabweichung rms varianz
effektivwert spannweite count anzahl variance
"""
_RESULTS = frozenset(_WORDS.split())


@dataclass(frozen=True)
class Dialect:
    """Layout of a text file; rows are counted from 1."""

    delimiter: str
    """The character between cells; " " stands for any run of blanks."""
    decimal: str
    """"." or ","."""
    names: tuple[str, ...]
    units: tuple[str, ...]
    """Cells of the row of names and of the row of units; empty where there is none."""
    names_row: int
    data_row: int
    """Row of the names, 0 if there is none, and first row of the data."""
    columns: int
    """Number of columns."""
    cells: int
    """Usual number of cells in a row, without an empty one behind a delimiter at its end."""
    dt_s: float | None = None
    """Sampling time that the header block states, or None."""
    dates: frozenset[int] = frozenset()
    """Numbers of the columns, from 0, that hold dates or times of day."""

    @property
    def words(self) -> str:
        """The layout in words."""
        shown = {"\t": "tabs", " ": "blanks", ",": "commas"}.get(
            self.delimiter, f"'{self.delimiter}'"
        )
        told = [f"text, columns separated by {shown}"]
        if self.decimal == ",":
            told.append("decimal comma")
        if self.names_row > 1:
            told.append(f"names in row {self.names_row}")
        elif self.names_row == 0:
            told.append("no names")
        if self.units:
            told.append("a row of units")
        return ", ".join(told)


def cells_of(line: str, delimiter: str) -> list[str]:
    """Returns the cells of a line, without blanks around them.

    Raises
    ------
    csv.Error
        the line cannot be divided.
    """
    if delimiter == " ":
        return line.split()
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    return [cell.strip() for cell in line.split(delimiter)]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with the given decimal mark."""
    return _NUMBER[decimal].fullmatch(cell) is not None


def is_date(cell: str) -> bool:
    """Whether a cell looks like a date, a time of day or both."""
    return len(cell) < 60 and _DATE.fullmatch(cell) is not None


def sniff(lines: Sequence[str], *, whole: bool) -> Dialect | None:
    """Returns the layout of a text file, or None if its lines are no table of numbers.

    `lines` are its first ones, at most `SAMPLE_LINES`; `whole` is whether these are all.
    """
    filled = [(row, line) for row, line in enumerate(lines, start=1) if line.strip()]
    if not whole:
        filled = filled[:-1]
    region = [line for _, line in filled[len(filled) // 2 :]]
    if not region:
        return None
    best: tuple[float, str, str] = (0.0, "", "")
    for delimiter in DELIMITERS:
        for decimal in ".,":
            score = _score(region, delimiter, decimal)
            if score > best[0] + 1e-9:
                best = (score, delimiter, decimal)
    score, delimiter, decimal = best
    if score < LEAST_SCORE:
        return None
    rows = [(row, _cells_or_line(line, delimiter)) for row, line in filled]
    columns = _usual_count([cells for _, cells in rows[len(rows) // 2 :]])
    is_data = [_is_data(cells, columns, decimal) for _, cells in rows]
    # A line of the header block may look like data, but not several.
    start = next((i for i in range(len(rows)) if all(is_data[i : i + SURE_ROWS])), None)
    if start is None:
        return None
    above = [(row, line) for row, line in filled[:start]]
    last = {cells[-1] for _, cells in rows[start:] if len(cells) == columns}
    named = columns - (last == {""})
    names_row, names, units = _header(above, named, delimiter, decimal)
    first = rows[start][1]
    widest = max(columns, len(names), *(len(c) for _, c in rows[start:] if len(c) <= len(names)))
    return Dialect(
        delimiter,
        decimal,
        names,
        units,
        names_row,
        rows[start][0],
        widest,
        named,
        _stated_step([line for row, line in above if row != names_row]),
        frozenset(
            i for i, cell in enumerate(first) if is_date(cell) and not is_number(cell, decimal)
        ),
    )


def _cells_or_line(line: str, delimiter: str) -> list[str]:
    """Returns the cells of a line; a line that cannot be divided is one cell."""
    try:
        return cells_of(line, delimiter)
    except csv.Error:
        return [line.strip()]


def _score(region: Sequence[str], delimiter: str, decimal: str) -> float:
    """Returns the share of cells that are numbers or dates, in rows of the usual count."""
    if delimiter == "," and decimal == "," and not any('"' in line for line in region):
        return 0.0
    if delimiter != " " and delimiter not in region[0] + region[-1]:
        return 0.0
    rows = [_cells_or_line(line, delimiter) for line in region]
    columns = _usual_count(rows)
    if columns < 2:
        return 0.0
    good = 0.0
    total = 0
    points = 0
    for cells in rows:
        if len(cells) == columns:
            good += sum(_value(cell, delimiter, decimal) for cell in cells)
            points += sum(decimal in cell for cell in cells)
        total += (
            max(columns, len(cells))
            if len(cells) != columns
            else sum(c.casefold() not in EMPTY for c in cells)
        )
    # Of two readings that fit, the one with decimals in use is right; whole numbers fit both.
    return good / max(total, 1) + (1e-3 if points else 0.0) - (1e-4 if decimal == "," else 0.0)


def _value(cell: str, delimiter: str, decimal: str) -> float:
    """Returns 1 for a number or a date, and less for a number in another notation."""
    if is_number(cell, decimal) or is_date(cell):
        return 1.0
    if delimiter != "," and (is_number(cell, ".") or is_number(cell, ",")):
        return 0.5  # a single column may have the other decimal mark
    return 0.9 if WITH_PREFIX.fullmatch(cell) else 0.0


def _usual_count(rows: Sequence[Sequence[str]]) -> int:
    counts = Counter(len(cells) for cells in rows)
    return counts.most_common(1)[0][0]


def _is_data(cells: Sequence[str], columns: int, decimal: str) -> bool:
    filled = [cell for cell in cells if cell.casefold() not in EMPTY]
    # A row of units may have cells such as "10 ms" too, but has no numbers beside them.
    numbers = sum(
        1.0 if is_number(cell, decimal) or is_date(cell) else 0.5
        for cell in filled
        if is_number(cell, decimal) or is_date(cell) or WITH_PREFIX.fullmatch(cell)
    )
    return (
        len(cells) >= max(2, columns - 1)
        and bool(filled)
        and 2 * numbers >= len(filled)
        and numbers > 0
    )


def _header(
    above: Sequence[tuple[int, str]], columns: int, delimiter: str, decimal: str
) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Returns row and cells of the names and the cells of the units, from the lines above."""
    rows: list[tuple[int, list[str]]] = []
    for row, line in reversed(above[-3:]):
        cells = _header_cells(line, columns, delimiter)
        if cells is None:
            break
        numbers = len(cells) > 2 and any(is_number(cell, decimal) for cell in cells)
        if numbers and not _are_units(cells):  # the unit of a fraction is 1
            break
        rows.append((row, cells))
    if not rows:
        return 0, (), ()
    if len(rows) > 1 and _are_units(rows[0][1]) and not _are_units(rows[1][1]):
        return rows[1][0], tuple(rows[1][1]), tuple(rows[0][1])
    return rows[0][0], tuple(rows[0][1]), ()


def _are_units(cells: Sequence[str]) -> bool:
    """Whether most cells below names are units, and none is a name; some may be unknown units."""
    filled = [cell for cell in cells if cell.strip(" -[]()")]
    unknown = [cell for cell in filled if not looks_like_a_unit(cell)]
    named = any(means(cell, channel) for cell in unknown for channel in CHANNELS)
    return len(filled) > 2 * len(unknown) and not named and any(map(str.isalpha, "".join(filled)))


def _header_cells(line: str, columns: int, delimiter: str) -> list[str] | None:
    """Returns the cells of a line above the data if they can be names or units, else None."""
    stripped = line.lstrip("#%/*' \t") if delimiter == " " else line.lstrip("#%/*'")
    for separator in (delimiter, *(d for d in DELIMITERS if d != delimiter)):
        try:
            cells = cells_of(stripped.strip("\r\n"), separator)
        except csv.Error:
            return None
        if separator == " " and len(cells) != columns:
            cells = re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", stripped)
            if len(cells) != columns:
                cells = [cell for cell in re.split(r"\s{2,}|\t", stripped.strip()) if cell]
        if columns <= len(cells) <= columns + 1 and columns >= 2:
            return cells
        if len(cells) > columns + 1 and separator == delimiter != " ":
            return cells
        fewer = len(cells) == columns - 1 > 1 or 2 * len(cells) == columns > 2
        if fewer and separator == delimiter != " " and all(cells):
            # One name less than columns, or half as many because of decimal commas, which the
            # reader refuses: no line as "Operator: A, B".
            return None if re.search("[:=]", stripped) else cells
    return None


def _stated_step(lines: Sequence[str]) -> float | None:
    """Returns the sampling time that a header block states, in seconds."""
    for line in lines:
        text = re.sub(r"[;,\t\"]+", " ", line).strip()
        if (match := _STEP_NAME.search(text)) and (step := _positive(match[1])):
            return step * (1e-3 if match[2] and match[2].lower() == "ms" else 1.0)
        if (match := _RATE.search(line)) and (rate := _positive(match[1])):
            return 1.0 / (rate * (1e3 if match[2] else 1.0))
        if (match := _RATE_NAME.search(text)) and (rate := _positive(match[1])):
            return 1.0 / rate
    return None


def _positive(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0.0 < value < 1e12 else None


def samples_of(
    body: bytes, delimiter: str, decimal: str, *, ended: bool
) -> tuple[bytes, list[str]]:
    """Returns the rows of the samples, and remarks on the last ones that are none of them.

    `ended` says whether the text ends with a line end.
    """
    body, notes = _without_results(body, delimiter)
    if notes or ended:
        return body, notes
    *before, last = [
        _cells_or_line(line.decode(), delimiter) for line in body.rsplit(b"\n", ROWS_OF_ONE_FORM)
    ]
    before = before[-ROWS_OF_ONE_FORM:]
    if before and (
        len(last) < len(before[-1])
        or is_cut([cells[-1] for cells in before if cells], last[-1], decimal)
    ):
        return body.rpartition(b"\n")[0], ["the last row is not complete and is left out"]
    return body, []


def _without_results(body: bytes, delimiter: str) -> tuple[bytes, list[str]]:
    *above, first = body.rsplit(b"\n", ROWS_OF_ONE_FORM)
    lines = [*above[1:], first]
    rows = [_cells_or_line(line.decode("utf-8", "replace"), delimiter) for line in lines]
    labels = [
        next((cell for cell in row if cell.strip(" .:\"'()").casefold() in _RESULTS), "")
        for row in rows
    ]
    start = len(rows)
    while start and (labels[start - 1] or not any(rows[start - 1])):
        start -= 1
    start += next((i for i, label in enumerate(labels[start:]) if label), 0)
    count = sum(1 for label in labels[start:] if label)
    # A word that stands in every row belongs to a column of words.
    if not 0 < count <= min(MOST_RESULTS, len(rows) // 2):
        return body, []
    what = "the last row is no sample" if count == 1 else f"the last {count} rows are no samples"
    kept = body[: len(body) - sum(len(line) + 1 for line in lines[start:])]
    return kept.rstrip(b"\n\t "), [f"{what} ('{labels[start]}'): left out"]


def has_results(body: bytes, delimiter: str) -> bool:
    """Whether rows of sums or means stand below a table."""
    return bool(_without_results(body.rstrip(b"\r\n\t "), delimiter)[1])


def is_cut(above: Sequence[str], last: str, decimal: str) -> bool:
    """Whether a number has too few decimals beside all of those above it to be whole.

    Numbers of as many digits as they need may end in a zero that is not written, but hardly in
    three.
    """
    counts = {len(cell.strip().partition(decimal)[2]) for cell in above}
    if len(above) < ROWS_OF_ONE_FORM:
        return False
    least = min(counts) - (2 if len(counts) > 1 else 0)
    return len(last.strip().partition(decimal)[2]) < least
