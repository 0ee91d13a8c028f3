# SPDX-License-Identifier: MIT
"""Reads NPZ files, the archives of NumPy: each array is a column; Python objects stay packed."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import BYTES, COLUMNS, RecordError, damage_named, first_line
from ..logs.log import Kind, Log, Part, Table, series_of

# First bytes of a zip archive and of a single array.
MAGIC = (b"PK", b"\x93NUMPY")


class NpzTable(Table):
    """The arrays of an archive; none is read before it is asked for."""

    ending = "npz"

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        if not data.startswith(MAGIC):
            raise RecordError(
                path,
                "this is not an NPZ file: it is no archive" if data else "the file is empty",
                expected="an NPZ file, as its name says",
                mend="export it again, or give it the extension of its real format",
            )
        with damage_named(path, "NPZ"):
            archive = np.load(BytesIO(data), allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise RecordError(
                path,
                "this is a single array, not an archive of named arrays",
                expected="an NPZ file",
                mend="write it with numpy.savez(path, time_s=..., command_v=...)",
            )
        self._archive = archive
        COLUMNS.check(len(archive.files), path)
        # The reader of an archive gives no more bytes of a file than the archive says it has.
        files = archive.zip.infolist() if archive.zip else []
        BYTES.check(sum(int(file.file_size) for file in files), path)

    def names(self) -> list[str]:
        """Returns the names of the arrays."""
        return list(self._archive.files)

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns arrays as they are in the file."""
        return {name: self._array(name) for name in wanted}

    def _array(self, name: str) -> npt.NDArray[Any]:
        try:
            array: npt.NDArray[Any] = self._archive[name]
        except Exception as error:  # zip file, array header and array each raise their own
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
        return array

    def log(self) -> Log:
        """Returns all signals of the file."""
        parts: list[Part] = []
        for name in self.names():
            values = self._array(name)
            fields = values.dtype.names or ()
            parts += [Part.of((name, field), values[field]) for field in fields]
            parts += [] if fields else [Part.of((name,), values)]
        return Log("NumPy archive", series_of(parts, self._path))


KIND = Kind(NpzTable, ("npz",))
