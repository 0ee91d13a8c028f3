# SPDX-License-Identifier: MIT
"""How large the sheets of an Excel (XML) or OpenDocument file become, before they are loaded.

The reader makes a rectangle of all cells between the first and the last one, and a copy of a text
for each cell that has it. A small file may so ask for any memory, and the reader then ends the
process. The bytes are searched as the reader reads them: it expands no entities.
"""

from __future__ import annotations

import re
import zipfile
from collections import Counter
from pathlib import Path

from ..limits import BYTES, COLUMNS, SAMPLES

CELL_BYTES = 32
# The reader takes no more from an OpenDocument file.
MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384

_PLACE = re.compile(rb"""\br\s*=\s*["']\s*([A-Za-z]{0,4})(\d{1,9})\b""")
_SHARED = re.compile(rb"""\bt\s*=\s*["']s["'][^>]*>\s*<(?:\w+:)?v[^>]*>\s*(\d{1,9})\s*<""")
_ANY_SHARED = re.compile(rb"""\bt\s*=\s*["']s["']""")
_END_OF_TEXT = re.compile(rb"</(?:\w+:)?si\s*>")
_TAG = re.compile(
    rb"<(/?)(?:\w+:)?(table|table-row|table-cell|covered-table-cell)(?=[\s/>])([^>]*?)(/?)>"
)
_REPEATED = re.compile(rb"""number-(?:columns|rows)-repeated\s*=\s*["'](\d+)""")


def check_sheets(archive: zipfile.ZipFile, path: Path) -> None:
    """Checks the sizes of the sheets in an archive whose own sizes are checked.

    Raises
    ------
    RecordError
        a sheet is beyond a limit.
    """
    names = [one for one in archive.namelist() if one.lower().endswith(".xml")]
    texts: list[int] = []
    for name in names:
        if name.lower().endswith("sharedstrings.xml"):
            texts = [len(one) for one in _END_OF_TEXT.split(archive.read(name))]
    for name in names:
        content = archive.read(name)
        if name == "content.xml":
            _check_ods(content, path)
        elif b"sheetData" in content:
            _check_xlsx(content, texts, path)


def _check_xlsx(content: bytes, texts: list[int], path: Path) -> None:
    columns: set[bytes] = set()
    rows = [MOST_ROWS, 0]
    for place in _PLACE.finditer(content):
        columns.add(place[1])
        row = int(place[2])
        rows = [min(rows[0], row), max(rows[1], row)]
    numbers = [_number(one) for one in columns if one]
    used = Counter(one[1] for one in _SHARED.finditer(content))
    total = sum(count * texts[int(one)] for one, count in used.items() if int(one) < len(texts))
    other = sum(1 for _ in _ANY_SHARED.finditer(content)) - sum(used.values())
    total += max(other, 0) * max(texts, default=0)
    _check(rows[1] - rows[0] + 1, max(numbers, default=0) - min(numbers, default=0) + 1, total,
           path)  # fmt: skip


def _number(letters: bytes) -> int:
    """Returns the number of a column, such as 28 of AB."""
    number = 0
    for letter in letters.upper():
        number = 26 * number + letter - ord("A") + 1
    return number


def _check_ods(content: bytes, path: Path) -> None:
    row = column = last_row = last_column = total = in_row = repeated_rows = cells_end = 0
    repeated_cells, filled = 1, False
    for tag in _TAG.finditer(content):
        closing, kind, attributes, empty = tag.groups()
        found = _REPEATED.search(attributes)
        repeated = int(found[1][:9]) if found else 1
        if kind == b"table":
            _check(last_row, last_column, total, path)
            row = last_row = last_column = total = 0
        elif kind == b"table-row":
            if not closing:
                repeated_rows, column, in_row, filled = min(repeated, MOST_ROWS), 0, 0, False
            if closing or empty:
                row = min(row + repeated_rows, MOST_ROWS)
                last_row = row if filled else last_row
                total += in_row * repeated_rows
        elif not closing:
            repeated_cells, cells_end = min(repeated, MOST_COLUMNS), tag.end()
            column = min(column + repeated_cells, MOST_COLUMNS)
            if not empty or b"value" in attributes:
                filled, last_column = True, max(last_column, column)
        else:
            in_row += repeated_cells * (tag.start() - cells_end)
    _check(last_row, last_column, total, path)


def _check(rows: int, columns: int, text_bytes: int, path: Path) -> None:
    COLUMNS.check(columns, path)
    SAMPLES.check(rows, path)
    BYTES.check(rows * columns * CELL_BYTES + text_bytes, path)
