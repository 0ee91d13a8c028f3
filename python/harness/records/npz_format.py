# SPDX-License-Identifier: MIT
"""Reads columns from NPZ files."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import RecordError, damaged, first_line
from .limits import BYTES, COLUMNS

# First bytes of a zip archive and of a single array.
MAGIC = (b"PK", b"\x93NUMPY")


class NpzTable:
    """A NumPy archive; each array is a column."""

    first_row = 1

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        if not data.startswith(MAGIC):
            raise RecordError(
                path,
                "this is not an NPZ file: it is no archive" if data else "the file is empty",
                expected="an NPZ file, as its name says",
                mend="export it again, or give it the extension of its real format",
            )
        try:
            archive = np.load(BytesIO(data), allow_pickle=False)
        # There is no common exception: zip file, array header and array each raise their own.
        except Exception as error:
            raise damaged(path, "NPZ", error) from None
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise RecordError(
                path,
                "this is a single array, not an archive of named arrays",
                expected="an NPZ file",
                mend="write it with numpy.savez(path, time_s=..., command_v=...)",
            )
        self._archive = archive
        self.names = list(archive.files)
        COLUMNS.check(len(self.names), path)
        # The reader of an archive gives no more bytes of a file than the archive says it has.
        files = archive.zip.infolist() if archive.zip else []
        BYTES.check(sum(int(file.file_size) for file in files), path)

    def text_names(self) -> list[str]:
        """Names of the arrays that hold text; none, because an array is read as a whole."""
        return []

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns the arrays `wanted` as they are in the file.

        Raises
        ------
        RecordError
            an array contains Python objects, or is damaged.
        """
        columns: dict[str, npt.NDArray[Any]] = {}
        for name in wanted:
            try:
                columns[name] = self._archive[name]
            except Exception as error:  # no common exception, as in __init__
                objects = "allow_pickle" in str(error)
                raise RecordError(
                    self._path,
                    "the array holds Python objects, which are never loaded"
                    if objects
                    else f"the array cannot be read ({first_line(error)})",
                    column=name,
                    expected="an array of numbers",
                    mend="convert it to float64 and write the file again",
                ) from None
        return columns
