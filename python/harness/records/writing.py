# SPDX-License-Identifier: MIT
"""Writes a record to a file, either completely or not at all."""

from __future__ import annotations

import gzip
import os
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..base.files import replacing
from ..catalogue.channels import TIME
from .errors import RecordError
from .record import Record

Format = Literal["csv", "csv.gz", "parquet", "mat", "npz"]

# Those that are written. "csv.gz" is one of its own: "rec.csv.gz" matches no other ending.
FORMATS: tuple[Format, ...] = ("csv.gz", "csv", "parquet", "mat", "npz")


def write_record(record: Record, path: str | os.PathLike[str]) -> None:
    """Writes the record in the format of the file's extension; replaces an existing file.

    Reading the file gives the same float64 values. The file appears under its name only when it is
    complete.

    Raises
    ------
    RecordError
        the extension is unknown, the format does not allow a column name, or the file cannot be
        written.
    """
    path = Path(path)
    content = record_bytes(record, path)
    try:
        with replacing(path) as unfinished:
            unfinished.write_bytes(content)
    except OSError as error:
        raise RecordError(
            path,
            f"the file cannot be written ({error.strerror})",
            expected="a folder that exists and may be written to",
            mend="create the folder, or choose another place",
        ) from None


def record_bytes(record: Record, path: str | os.PathLike[str]) -> bytes:
    """Returns the content of a record's file in the format of the file's extension.

    Raises
    ------
    RecordError
        the extension is unknown, or the format does not allow a column name; it names the path.
    """
    path = Path(path)
    kind = format_of(path)
    columns: dict[str, npt.NDArray[np.float64]] = dict(record.columns)
    if record.time_s is not None:
        columns = {TIME: record.time_s, **columns}
    if kind == "mat":
        _check_mat_names(columns, path)
    return _encode(columns, kind)


def _encode(columns: dict[str, npt.NDArray[np.float64]], kind: Format) -> bytes:
    # Only the library of the file's format is imported: polars and scipy take long to import.
    buffer = BytesIO()
    match kind:
        case "csv":
            import polars as pl

            pl.DataFrame(columns).write_csv(buffer)
        case "csv.gz":
            # Without a time stamp, the same record always gives the same bytes.
            return gzip.compress(_encode(columns, "csv"), compresslevel=6, mtime=0)
        case "parquet":
            import polars as pl

            pl.DataFrame(columns).write_parquet(buffer)
        case "mat":
            import scipy.io

            file: Any = buffer  # the stubs accept only paths; the function takes any binary file
            scipy.io.savemat(file, columns, oned_as="column", do_compression=True)
        case "npz":
            np.savez_compressed(buffer, **columns)  # type: ignore[arg-type]
    return buffer.getvalue()


def _check_mat_names(columns: dict[str, npt.NDArray[np.float64]], path: Path) -> None:
    for name in columns:
        if not (name.isascii() and name.isidentifier() and name[0] != "_" and len(name) <= 63):
            raise RecordError(
                path,
                "MATLAB does not allow this name for a variable",
                column=name,
                expected="a letter, then letters, digits and underscores, 63 at most",
                mend="rename the column, or write another format",
            )


def format_of(path: Path) -> Format:
    """Returns the format that belongs to the ending of the name, in upper or lower case.

    Raises
    ------
    RecordError
        the ending is unknown.
    """
    for ending in FORMATS:
        if path.name.lower().endswith("." + ending):
            return ending
    raise unknown_ending(path, sorted(FORMATS))


def unknown_ending(
    path: Path,
    endings: Sequence[str],
    mend: str = "export or convert the record to one of these formats",
) -> RecordError:
    """Returns the error for a name with an ending that is none of those listed."""
    problem = (
        f"the extension '{path.suffix}' is not known" if path.suffix else "it has no extension"
    )
    listed = ", ".join("." + ending for ending in endings)
    return RecordError(path, problem, expected=f"one of {listed}", mend=mend)
