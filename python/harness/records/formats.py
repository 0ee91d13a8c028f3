# SPDX-License-Identifier: MIT
"""Determines the format of a file from its name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from .errors import RecordError
from .unread import first_bytes, refusal

Format = Literal["csv", "csv.gz", "parquet", "mat", "npz"]

# "csv.gz" is a format of its own: a name such as "rec.csv.gz" matches no other ending.
FORMATS: tuple[Format, ...] = ("csv.gz", "csv", "parquet", "mat", "npz")
# An export of TwinCAT Scope begins with "Name", as many tables do; its other rows are its own.
SCOPE_HEAD = (
    rb"(?:\xef\xbb\xbf)?Name[\t ,:;](?:[^\n]*\n){1,30}?"
    rb"(?:Starttime of export|SymbolComment|SymbolName|SampleTime\[ms\])[\t ,:;]"
)


@dataclass(frozen=True)
class Kind:
    """A kind of file that is read as a log.

    Attributes
    ----------
    module
        module of `records/logs` that reads it.
    endings
        endings of its names.
    head
        regular expression of its first bytes, which tell it whatever the name says; None if they
        are like those of other files.
    """

    module: str
    endings: tuple[str, ...]
    head: bytes | None = None


TEXT_ENDINGS = ("txt.gz", "tsv.gz", "dat.gz", "txt", "tsv", "tab", "dat", "asc", "log", "prn")
# The first kind whose head fits reads the file; a new kind is a line here, and its module.
KINDS = (
    Kind("lvm", ("lvm",), rb"(?:\xef\xbb\xbf)?LabVIEW Measurement"),
    Kind("scope_csv", (), SCOPE_HEAD),
    Kind("text", ("csv.gz", "csv", *TEXT_ENDINGS)),
    Kind("spreadsheet", ("xlsx", "xlsm", "xlsb", "xls", "ods")),
    Kind("hdf5", ("h5", "hdf5", "hdf"), rb"\x89HDF\r\n\x1a\n"),
    Kind("mdf", ("mf4", "mdf", "mf3", "mdf3"), rb"MDF     |UnFinMF "),
    Kind("tdms", ("tdms",), rb"TDSm"),
    Kind("mcap", ("mcap",), rb"\x89MCAP0\r\n"),
    Kind("rosbag", ("bag", "db3"), rb"#ROSBAG V2\.0"),
    Kind("parquet", ("parquet",)),
    Kind("npz", ("npz",)),
    Kind("mat", ("mat",)),
)
LOG_ENDINGS = tuple(one for kind in KINDS for one in kind.endings if one not in FORMATS)
# What is taken for a record in a folder: text of any other ending may be a note.
FOLDER_ENDINGS = (
    *(one for one in (*FORMATS, *LOG_ENDINGS) if one not in TEXT_ENDINGS),
    *("tsv", "tsv.gz", "tab"),
)


def told_by_head(data: bytes) -> Kind | None:
    """Returns the kind that the first bytes of a file tell, or None if they tell none."""
    return next((kind for kind in KINDS if kind.head and re.match(kind.head, data)), None)


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
    known = refusal(path)
    if known is not None:
        raise known
    endings = sorted((*FORMATS, *LOG_ENDINGS))
    if (kind := told_by_head(first_bytes(path))) is not None:
        endings = list(kind.endings or FORMATS[1:2])
    listed = ", ".join("." + ending for ending in endings)
    raise RecordError(
        path,
        f"the extension '{path.suffix}' is not known" if path.suffix else "it has no extension",
        expected=f"one of {listed}",
        mend="export or convert the record to one of these formats"
        if kind is None
        else f"rename it to end in .{endings[0]}, because its first bytes are those of such a file",
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
