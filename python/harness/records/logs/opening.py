# SPDX-License-Identifier: MIT
"""Opens a log of any kind, each with the reader of its kind, which is imported only then."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path

from ehsid.harness.error_words import install_line
from ehsid.harness.records.csv_text import decompress
from ehsid.harness.records.errors import RecordError
from ehsid.harness.records.formats import TEXT_ENDINGS
from ehsid.harness.records.logs.log import Log

# Ending -> module of this package, and the first bytes that tell a kind whatever the name says.
MODULES = {
    **dict.fromkeys(("csv", "csv.gz", *TEXT_ENDINGS), "text"),
    **dict.fromkeys(("xlsx", "xlsm", "xlsb", "xls", "ods"), "spreadsheet"),
    **dict.fromkeys(("h5", "hdf5", "hdf"), "hdf5"),
    **dict.fromkeys(("mf4", "mdf", "mf3"), "mdf"),
    **dict.fromkeys(("bag", "db3"), "rosbag"),
    "parquet": "parquet",
    "npz": "npz",
    "mat": "mat",
    "tdms": "tdms",
    "mcap": "mcap",
}
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
MATLAB_HEAD = 512  # bytes in front of it in a MAT file of version 7.3
MAGIC = (
    (b"MDF     ", "mdf"),
    (b"UnFinMF ", "mdf"),
    (b"TDSm", "tdms"),
    (b"\x89MCAP0\r\n", "mcap"),
    (b"#ROSBAG V2.0", "rosbag"),
    (HDF5_MAGIC, "hdf5"),
)


def open_log(data: bytes, path: Path, ending: str, refused: RecordError | None = None) -> Log:
    """Returns the log in a file.

    Parameters
    ----------
    data
        content of the file; empty for a folder.
    path
        name of the file or folder.
    ending
        its kind, as `formats.ending_of` returns it.
    refused
        why it is no record of the schema; raised in place of an error that says less.

    Raises
    ------
    RecordError
        the file cannot be read; a package that its kind needs is not installed.
    """
    if ending.endswith(".gz"):
        data = decompress(data, path)
    module = next((name for magic, name in MAGIC if data.startswith(magic)), MODULES[ending])
    if ending == "mat" and data.startswith(HDF5_MAGIC, MATLAB_HEAD):
        module = "hdf5"
    try:
        read: Callable[[bytes, Path], Log] = importlib.import_module(
            f"ehsid.harness.records.logs.{module}"
        ).read
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("ehsid"):
            raise
        raise RecordError(
            path,
            f"the package '{error.name}', which reads files of this kind, is not installed",
            expected="the packages that read logs",
            mend=f"install them with: {install_line('logs')}",
        ) from None
    try:
        return read(data, path)
    except RecordError as error:
        # An error with a row says more than why the file is no record of the schema.
        if refused is not None and error.row is None:
            raise refused from None
        raise
