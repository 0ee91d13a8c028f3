# SPDX-License-Identifier: MIT
"""Reads logs from the sheets of Excel and OpenDocument files."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import fastexcel
import numpy as np
import polars as pl

from ...base.arrays import FloatArray
from ..errors import RecordError, damaged
from ..limits import BYTES, COLUMNS, SAMPLES
from .log import Log, Series
from .sheet_size import check_sheets
from .text import table_log

MOST_SHEETS = 50
NINE_DECIMALS = 1e-9


def read(data: bytes, path: Path) -> Log:
    """Returns the sheet with most rows of numbers as a log.

    Raises
    ------
    RecordError
        the file is damaged or beyond a limit, or no sheet is a table of numbers.
    """
    _check_size(data, path)
    with _damage_named(path):
        book = fastexcel.read_excel(data)
        names = list(book.sheet_names)[:MOST_SHEETS]
        sheets = [(name, _as_text(book, name, path)) for name in names]
    logs = []
    for name, text in sheets:
        log = table_log(text, path) if text.strip() else None
        if log is not None:
            log = replace(log, series=_exact(log, book, name, path))
            logs.append((max(one.size for one in log.series), name, log))
    if not logs:
        raise RecordError(
            path,
            "no sheet is a table of numbers",
            expected="a sheet with names above columns of numbers",
            mend="put the signals into one sheet, one in each column",
        )
    _, name, log = max(logs, key=lambda one: one[0])
    layout = log.kind.removeprefix("text, columns separated by tabs").removeprefix(", ")
    kind = f"spreadsheet, sheet '{name}'" + (f", {layout}" if layout else "")
    others = [other for _, other, _ in logs if other != name]
    notes = (f"other sheets are not read: {', '.join(others)}",) if others else ()
    return replace(log, kind=kind, notes=(*log.notes, *notes))


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except (RecordError, KeyboardInterrupt):
        raise
    except BaseException as error:  # the reader is in Rust: its panics are no Exception
        raise damaged(path, "spreadsheet", error) from None


def _check_size(data: bytes, path: Path) -> None:
    """Checks the sizes that a zip file states, and those of its sheets, before they are loaded."""
    if not data.startswith(b"PK"):
        return
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            BYTES.check(sum(one.file_size for one in archive.infolist()), path)
            check_sheets(archive, path)
    except RecordError:
        raise
    except Exception as error:  # BadZipFile, zlib.error, NotImplementedError, as the damage is
        raise damaged(path, "spreadsheet", error) from None


def _exact(log: Log, book: Any, name: str, path: Path) -> tuple[Series, ...]:
    """Returns the series with the numbers of the cells, of which the text has nine decimals only.

    A cell that is text, such as a number with a decimal comma, is read from the text.
    """

    @cache
    def cells() -> pl.DataFrame:
        sheet = book.load_sheet(name, header_row=None, skip_rows=log.first_row - 1, dtypes="float")
        frame: pl.DataFrame = sheet.to_polars()
        return frame

    def exact(one: Series) -> Series:
        def values() -> FloatArray:
            from_text = one.read()
            assert one.column is not None
            with _damage_named(path):
                column = cells().to_series(one.column).head(one.size)
            numbers = column.extend_constant(None, one.size - len(column))
            found = numbers.fill_null(float("nan")).to_numpy()
            # The number of a cell with text is what Excel would make of "1.000", not the log.
            return np.where(np.abs(found - from_text) <= NINE_DECIMALS, found, from_text)

        return one if one.is_time or one.column is None else replace(one, read=cache(values))

    return tuple(exact(one) for one in log.series)


def _as_text(book: Any, name: str, path: Path) -> bytes:
    """Returns a sheet as lines with tabs between the cells."""
    sheet = book.load_sheet(name, header_row=None, skip_rows=0, dtypes="string")
    COLUMNS.check(sheet.width, path)
    SAMPLES.check(sheet.total_height, path)
    frame = sheet.to_polars()
    if not frame.width:
        return b""
    clean = frame.select(pl.all().cast(pl.String).str.replace_all(r"[\t\r\n]+", " ").fill_null(""))
    buffer = BytesIO()
    clean.write_csv(buffer, include_header=False, separator="\t", quote_style="never")
    return buffer.getvalue()
