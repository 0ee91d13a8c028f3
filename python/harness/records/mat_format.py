# SPDX-License-Identifier: MIT
"""Reads columns from MAT files."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.io
import scipy.sparse

from .errors import RecordError, damaged
from .limits import BYTES, COLUMNS
from .mat_elements import check_elements

# A file of version 7.3 is HDF5 behind a head of MATLAB.
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
HDF5_AT = 512


class MatTable:
    """A MAT file of version 4 to 7; each variable is a column."""

    first_row = 1

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        try:
            check_elements(data, partial(BYTES.check, file=path))
            # Some versions of the type stubs accept only paths; the function reads any binary file.
            file: Any = BytesIO(data)
            with warnings.catch_warnings():
                # scipy 1.18 warns that sparse variables will be of another class. This does not
                # matter here, because all sparse variables are refused.
                warnings.filterwarnings("ignore", ".*`spmatrix`", DeprecationWarning)
                # All objects of MATLAB, such as timetables, are called "None" by this reader.
                warnings.filterwarnings("ignore", "Duplicate variable name .None.")
                content = scipy.io.loadmat(file)
        except RecordError:
            raise
        except NotImplementedError:
            raise RecordError(
                path,
                "this is a MAT file of version 7.3 (HDF5), which is not read",
                expected="a MAT file of version 4 to 7",
                mend="save it in MATLAB with save('name.mat', '-v7')",
            ) from None
        except Exception as error:  # scipy has no common exception for damaged files
            raise damaged(path, "MAT", error) from None
        self.variables = {k: v for k, v in content.items() if not k.startswith("__")}
        self.names = list(self.variables)
        COLUMNS.check(len(self.names), path)

    def text_names(self) -> list[str]:
        """Names of the variables that hold text."""
        return [
            name
            for name, value in self.variables.items()
            if isinstance(value, np.ndarray) and value.dtype.kind == "U"
        ]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns the variables `wanted` as they are in the file.

        Raises
        ------
        RecordError
            a variable is a sparse matrix.
        """
        return {name: self._dense(name) for name in wanted}

    def _dense(self, name: str) -> npt.NDArray[Any]:
        variable = self.variables[name]
        shape = variable.shape
        # A sparse matrix has the dimensions that the file states, however few values it holds.
        if scipy.sparse.issparse(variable):
            raise RecordError(
                self._path,
                f"the values are a sparse matrix, {' x '.join(map(str, shape))}",
                column=name,
                expected="a vector, one value a sample",
                mend="store the signal with full(...)",
            )
        return np.asarray(variable)
