# SPDX-License-Identifier: MIT
"""Opens a log of any kind, each with the reader of its kind, which is imported only then."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path

from ...base.error_words import install_line
from ..csv_text import decompress
from ..errors import RecordError
from ..formats import KINDS, told_by_head
from ..unread import HEAD_BYTES, refusal
from .log import Log

# Ending -> module of this package.
MODULES = {ending: kind.module for kind in KINDS for ending in kind.endings}
MATLAB_HEAD = 512  # bytes in front of HDF5 in a MAT file of version 7.3


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
    kind = told_by_head(data)
    if kind is None and ending == "mat":
        kind = told_by_head(data[MATLAB_HEAD : MATLAB_HEAD + HEAD_BYTES])
    if kind is None and (known := refusal(path, data)) is not None:
        raise known
    module = MODULES[ending] if kind is None else kind.module
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
