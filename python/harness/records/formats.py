# SPDX-License-Identifier: MIT
"""Determines the format of a file from its name."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ehsid.harness.records.errors import RecordError

Format = Literal["csv", "csv.gz", "parquet", "mat", "npz"]

# "csv.gz" is a format of its own: a name such as "rec.csv.gz" matches no other ending.
FORMATS: tuple[Format, ...] = ("csv.gz", "csv", "parquet", "mat", "npz")

# Further kinds of files that are read as logs, with the endings of their names.
TEXT_ENDINGS = ("txt.gz", "tsv.gz", "dat.gz", "txt", "tsv", "tab", "dat", "asc", "log", "prn")
BINARY_ENDINGS = (
    *("xlsx", "xlsm", "xlsb", "xls", "ods", "h5", "hdf5", "hdf", "mf4", "mdf", "mf3", "tdms"),
    *("mcap", "bag", "db3"),
)
LOG_ENDINGS = (*TEXT_ENDINGS, *BINARY_ENDINGS)
# What is taken for a record in a folder: text of any other ending may be a note.
FOLDER_ENDINGS = (*FORMATS, "tsv", "tsv.gz", "tab", *BINARY_ENDINGS)


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
    listed = ", ".join("." + ending for ending in sorted(FORMATS))
    raise RecordError(
        path,
        f"the extension '{path.suffix}' is not known" if path.suffix else "it has no extension",
        expected=f"one of {listed}",
        mend="export or convert the record to one of these formats",
    )


def ending_of(path: Path) -> str:
    """Returns the ending of a file that can be read as a record or a log, in lower case.

    Raises
    ------
    RecordError
        the ending is unknown.
    """
    for ending in (*FORMATS, *LOG_ENDINGS):
        if path.name.lower().endswith("." + ending):
            return ending
    listed = ", ".join("." + ending for ending in sorted((*FORMATS, *LOG_ENDINGS)))
    raise RecordError(
        path,
        f"the extension '{path.suffix}' is not known" if path.suffix else "it has no extension",
        expected=f"one of {listed}",
        mend="export or convert the record to one of these formats",
    )


def stem_of(path: Path) -> str:
    """Returns the name without its ending: "run.csv.gz" gives "run"."""
    return path.name[: -len(ending_of(path)) - 1]


def records_in(folder: Path) -> list[Path]:
    """Returns the records and logs of a folder, sorted by name, without those of its sub-folders.

    Hidden files and text files with an ending that a note may have are left out.
    """
    endings = tuple(f".{ending}" for ending in FOLDER_ENDINGS)
    return sorted(
        path
        for path in folder.iterdir()
        if path.is_file() and path.name.lower().endswith(endings) and path.name[0] != "."
    )
