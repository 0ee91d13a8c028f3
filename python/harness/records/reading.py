# SPDX-License-Identifier: MIT
"""Reads a record from a file."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ehsid.harness.catalogue.channels import CHANNELS, REQUIRED_COLUMNS, TIME
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
from ehsid.harness.records.limits import read_file
from ehsid.harness.records.record import Record, make_record

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
    """Reads and checks a record.

    Parameters
    ----------
    path
        file in the format CSV, CSV.gz, Parquet, MAT (version 4 to 7) or NPZ, given by the
        extension.
    columns
        names of the columns to read; `time_s` is also read if the file has it. None reads all
        columns, which must then all be numbers.
    required
        names of columns that must exist; by default those in `columns`, or `time_s` and
        `command_v` if `columns` is None.
    layout
        columns of the schema that have other names or units in the file, as in `[columns]` of a
        rig. `columns` and `required` use the names of the schema. Layout columns that are read must
        be in the file, unless the file has only names of the schema instead.

    Returns
    -------
    The record; without a `time_s` column its `dt_s` is None.

    Raises
    ------
    RecordError
        the file has a problem; the message says where it is and how to mend it.
    """
    path = Path(path)
    data = _bytes(path)
    table = _table(data, path)
    if required is None:
        required = REQUIRED_COLUMNS if columns is None else tuple(columns)
    check_layout(layout, path)
    layout = layout_of(table.names, layout)
    names = names_in_file(table.names, layout, path)
    requested = {*names, *layout} if columns is None else {*columns, *required, TIME}
    for name in (*required, *(target for target in layout if target in requested)):
        name_in_file = layout[name].name if name in layout else name
        if names.get(name) != name_in_file:
            raise missing_column(path, name_in_file, table.names, _why(name))
    wanted = {name: names[name] for name in names if name in requested}
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
    """Returns the columns by their name in the record, in the units of the record."""
    read = table.read(list(dict.fromkeys(wanted.values())))
    # The check comes before the renaming, so that messages use the column names of the file.
    arrays = check_columns(read, file=path, first_row=table.first_row)
    return {
        target: in_schema_unit(arrays[name], layout[target], CHANNELS[target].unit)
        if target in layout
        else arrays[name]
        for target, name in wanted.items()
    }


def _bytes(path: Path) -> bytes:
    if "\0" in str(path):
        raise RecordError(
            path,
            "the path has a zero byte",
            expected="a record file",
            mend="check the path",
        )
    if path.is_dir():
        raise RecordError(
            path,
            "this is a directory",
            expected="a record file",
            mend="name one of the files in it",
        )
    format_of(path)
    try:
        return read_file(path)
    except FileNotFoundError:
        problem, mend = "there is no such file", "check the path"
    except OSError as error:
        problem, mend = f"the file cannot be read ({error.strerror})", "check its permissions"
    raise RecordError(path, problem, expected="a record file", mend=mend)


def _table(data: bytes, path: Path) -> Table:
    # Only the library of the file's format is imported: polars and scipy take long to import.
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
    channel = CHANNELS.get(name)
    return f"{channel.meaning}, in {channel.unit}" if channel else "a column of this name"
