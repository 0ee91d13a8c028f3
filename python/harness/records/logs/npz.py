# SPDX-License-Identifier: MIT
"""Reads logs from NPZ files."""

from __future__ import annotations

from pathlib import Path

from ..npz_format import NpzTable
from .arrays import Part, series_of
from .log import Log


def read(data: bytes, path: Path) -> Log:
    """Returns the arrays of a NumPy archive as a log; Python objects are never unpacked.

    Raises
    ------
    RecordError
        the file is damaged or beyond a limit.
    """
    table = NpzTable(data, path)
    parts = []
    for name in table.names:
        values = table.read([name])[name]
        if values.dtype.names:
            for field in values.dtype.names:
                of_field = values[field]
                parts.append(Part((name, field), of_field.shape, of_field.dtype, of_field.copy))
        else:
            parts.append(Part((name,), values.shape, values.dtype, values.copy))
    return Log("NumPy archive", series_of(parts, path))
