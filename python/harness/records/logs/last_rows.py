# SPDX-License-Identifier: MIT
"""What stands at the end of a text and is no sample: an unfinished row, sums and means."""

from __future__ import annotations

import csv
from collections.abc import Sequence

from ..csv_text import ROWS_OF_ONE_FORM, is_cut
from .dialect import cells_of

# Rows of results below a table are fewer.
MOST_RESULTS = 12
_WORDS = """
sum summe total gesamt somme suma somma mean mittel mittelwert average avg durchschnitt moyenne
promedio median min minimum max maximum std stdev stddev stdabw standardabweichung rms varianz
effektivwert spannweite count anzahl variance
"""
_RESULTS = frozenset(_WORDS.split())


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
        _cells(line.decode(), delimiter) for line in body.rsplit(b"\n", ROWS_OF_ONE_FORM)
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
    rows = [_cells(line.decode("utf-8", "replace"), delimiter) for line in lines]
    labels = [next((cell for cell in row if _is_result(cell)), "") for row in rows]
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


def _is_result(cell: str) -> bool:
    return cell.strip(" .:\"'()").casefold() in _RESULTS


def _cells(line: str, delimiter: str) -> Sequence[str]:
    try:
        return cells_of(line, delimiter)
    except csv.Error:
        return [line]
