# SPDX-License-Identifier: MIT
"""Reads tables and timetables of MAT files, whose layout MATLAB does not publish."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

from ...base.error_words import install_line
from ...base.files import temporary_folder
from ..errors import first_line
from .arrays import Part

ADVICE = (
    "save its numbers in MATLAB, such as s.time_s = seconds(T.Time); s.position_m = T.Position; "
    "or write it with parquetwrite or writetimetable"
)


def object_parts(data: bytes, notes: list[str]) -> list[Part]:
    """Returns the columns of the tables and timetables among the variables of a MAT file.

    What cannot be read is said in `notes`.
    """
    try:
        import matio
    except ModuleNotFoundError:
        notes.append(f"tables and other objects are left out: {install_line('logs')}, or {ADVICE}")
        return []
    with temporary_folder() as folder:  # the reader takes a path only
        file = folder / "log.mat"
        file.write_bytes(data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                content = matio.load_from_mat(str(file), add_table_attrs=True)
        except Exception as error:  # the reader has no common exception
            notes.append(f"tables and other objects are left out ({first_line(error)}): {ADVICE}")
            return []
    parts = [part for name, value in content.items() for part in _of_table(name, value)]
    if not parts:
        notes.append(f"objects that are no tables or timetables are left out: {ADVICE}")
    return parts


def _of_table(name: str, table: Any) -> Iterator[Part]:
    """Yields the columns of a pandas table, and its index where that is a time."""
    if not (hasattr(table, "columns") and hasattr(table, "index")):
        return
    units = table.attrs.get("varUnits")
    index = table.index.to_numpy()
    if index.dtype.kind in "mM":
        yield Part((name, str(table.index.name or "Time")), index.shape, index.dtype, index.copy)
    for k, column in enumerate(table.columns):
        values = table[column].to_numpy()
        unit = str(units[k]).strip() if units is not None and k < len(units) else ""
        yield Part((name, str(column)), values.shape, values.dtype, values.copy, unit or None)
