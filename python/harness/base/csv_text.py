# SPDX-License-Identifier: MIT
"""Columns as CSV text."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from io import StringIO
from typing import Any

import numpy.typing as npt

BLOCK_ROWS = 10_000


def csv_text(columns: Mapping[str, npt.NDArray[Any]]) -> str:
    """Returns columns of equal length as CSV with their names in row 1.

    A float64 has as many digits as it needs to be read back exactly; NaN is an empty cell.
    """
    buffer = StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    rows = max(map(len, columns.values()))
    for start in range(0, rows, BLOCK_ROWS):
        blocks = [_cells(values[start : start + BLOCK_ROWS]) for values in columns.values()]
        writer.writerows(zip(*blocks, strict=True))
    return buffer.getvalue()


def _cells(values: npt.NDArray[Any]) -> list[Any]:
    cells: list[Any] = values.tolist()
    if values.dtype.kind != "f":
        return cells
    text = "\n".join(map(repr, cells)).replace("nan", "")
    if "e-0" in text:
        text = re.sub(r"(\d)(?:\.(\d+))?e-05", r"0.0000\1\2", text).replace("e-0", "e-")
    return text.split("\n")
