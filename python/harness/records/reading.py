# SPDX-License-Identifier: MIT
"""Reading a record from a file."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ehsid.harness.records.checks import check_columns
from ehsid.harness.records.csv_text import decompress
from ehsid.harness.records.errors import RecordError, missing_column
from ehsid.harness.records.formats import format_of, stem_of
from ehsid.harness.records.layout import (
    ColumnMap,
    Layout,
    check_layout,
    in_schema_unit,
    layout_of,
    names_in_file,
)
from ehsid.harness.records.record import Record, make_record
from ehsid.harness.records.schema import COLUMNS, REQUIRED_COLUMNS, TIME_COLUMN

if TYPE_CHECKING:
    from ehsid.harness.records.csv_format import CsvTable
    from ehsid.harness.records.mat_format import MatTable
    from ehsid.harness.records.npz_format import NpzTable
    from ehsid.harness.records.parquet_format import ParquetTable

    Table = CsvTable | ParquetTable | MatTable | NpzTable

AS_THE_SCHEMA: Layout = MappingProxyType({})


def read_record(
    path: str | os.PathLike[str],
    *,
    columns: Sequence[str] | None = None,
    required: Sequence[str] | None = None,
    layout: Mapping[str, ColumnMap] = AS_THE_SCHEMA,
) -> Record:
    """Read and check a record.

    Parameters
    ----------
    path
        CSV, CSV.gz, Parquet, MAT (version 4 to 7) or NPZ, told by the extension.
    columns
        names to read; `time_s` is read as well where the file has it. None reads all
        columns, which must then all be numbers.
    required
        names that must be there. By default those in `columns`, or where that is None
        `time_s` and `command_v`.
    layout
        columns of the schema that the file has under other names or in other units, as in
        `[columns]` of a rig. `columns` and `required` name them as the schema does; those that
        are read must be in the file, unless it has none of these names but those of the schema.

    Returns
    -------
    The record; without a `time_s` column its `dt_s` is None.

    Raises
    ------
    RecordError
        whatever is wrong with the file; the message says where and how to mend it.
    """
    path = Path(path)
    data = _bytes(path)
    table = _table(data, path)
    if required is None:
        required = REQUIRED_COLUMNS if columns is None else tuple(columns)
    check_layout(layout, path)
    layout = layout_of(table.names, layout)
    names = names_in_file(table.names, layout, path)
    asked = {*names, *layout} if columns is None else {*columns, *required, TIME_COLUMN}
    for name in (*required, *(target for target in layout if target in asked)):
        told = layout[name].name if name in layout else name
        if names.get(name) != told:
            raise missing_column(path, told, table.names, _why(name))
    wanted = {name: names[name] for name in names if name in asked}
    return make_record(
        _arrays(table, wanted, layout, path),
        name=stem_of(path),
        source=path,
        sha256=hashlib.sha256(data).hexdigest(),
        first_row=table.first_row,
    )


def _arrays(
    table: Table, wanted: Mapping[str, str], layout: Layout, path: Path
) -> dict[str, npt.NDArray[np.float64]]:
    """Columns by name of the record, in its units."""
    read = table.read(list(dict.fromkeys(wanted.values())))
    # Before they are renamed, so that messages name the columns as the file does.
    arrays = check_columns(read, file=path, first_row=table.first_row)
    return {
        target: in_schema_unit(arrays[name], layout[target], COLUMNS[target].unit)
        if target in layout
        else arrays[name]
        for target, name in wanted.items()
    }


def _bytes(path: Path) -> bytes:
    if path.is_dir():
        raise RecordError(
            path,
            "this is a directory",
            expected="a record file",
            mend="name one of the files in it",
        )
    format_of(path)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        problem, mend = "there is no such file", "check the path"
    except OSError as error:
        problem, mend = f"the file cannot be read ({error.strerror})", "check its permissions"
    raise RecordError(path, problem, expected="a record file", mend=mend)


def _table(data: bytes, path: Path) -> Table:
    # A file needs the library of its own format only: polars and scipy take long to import.
    match format_of(path):
        case "csv" | "csv.gz" as kind:
            from ehsid.harness.records.csv_format import CsvTable

            return CsvTable(data if kind == "csv" else decompress(data, path), path)
        case "parquet":
            from ehsid.harness.records.parquet_format import ParquetTable

            return ParquetTable(data, path)
        case "mat":
            from ehsid.harness.records.mat_format import MatTable

            return MatTable(data, path)
        case "npz":
            from ehsid.harness.records.npz_format import NpzTable

            return NpzTable(data, path)


def _why(name: str) -> str:
    known = COLUMNS.get(name)
    return f"{known.meaning}, in {known.unit}" if known else "a column of this name"
