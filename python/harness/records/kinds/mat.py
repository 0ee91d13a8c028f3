# SPDX-License-Identifier: MIT
"""Reads MAT files of version 4 to 7: variables, structures, Simulink logs, tables, dSPACE.

A file of version 7.3 is HDF5 (`hdf5`) behind a head of MATLAB.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.error_words import install_line
from ...base.files import temporary_folder
from ..errors import RecordError, damaged, first_line
from ..limits import BYTES, COLUMNS
from ..logs import dspace
from ..logs.arrays import Part, series_of
from ..logs.log import Kind, Log, Table
from ..mat_elements import check_elements

MAX_DEPTH = 8
MOST_ELEMENTS = 64
# How objects of MATLAB, such as timetables, come out of the reader.
OPAQUE = "MatlabOpaque"
ADVICE = (
    "save its numbers in MATLAB, such as s.time_s = seconds(T.Time); s.position_m = T.Position; "
    "or write it with parquetwrite or writetimetable"
)


class MatTable(Table):
    """The variables of a file; as a log also the fields of structures, with paths as names."""

    ending = "mat"

    def __init__(self, data: bytes, path: Path) -> None:
        import scipy.io

        self._path = path
        self._data = data
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
        self._variables = {k: v for k, v in content.items() if not k.startswith("__")}
        COLUMNS.check(len(self._variables), path)

    def names(self) -> list[str]:
        """Returns the names of the variables."""
        return list(self._variables)

    def text_names(self) -> list[str]:
        """Returns the names of the variables that hold text."""
        return [
            name
            for name, value in self._variables.items()
            if isinstance(value, np.ndarray) and value.dtype.kind == "U"
        ]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns variables as they are in the file."""
        return {name: self._dense(name) for name in wanted}

    def _dense(self, name: str) -> npt.NDArray[Any]:
        import scipy.sparse

        variable = self._variables[name]
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

    def log(self) -> Log:
        """Returns all signals of the file."""
        notes: list[str] = []
        recorded = {name: v for name, v in self._variables.items() if dspace.is_recording(v)}
        if recorded and recorded.keys() == self._variables.keys():
            series = [
                one
                for name, value in recorded.items()
                for one in dspace.series_of_recording(
                    value, self._path, notes, within=f"{name}." if len(recorded) > 1 else ""
                )
            ]
            return Log(dspace.KIND, tuple(series), 1, tuple(notes))
        parts = [part for name, v in self._variables.items() for part in _parts((name,), v, 0)]
        if any(type(value).__name__ == OPAQUE for value in self._variables.values()):
            parts += object_parts(self._data, notes)
        return Log("MAT file", series_of(parts, self._path), 1, tuple(notes))


def _parts(path: tuple[str, ...], value: Any, depth: int) -> Iterator[Part]:
    if type(value).__name__ == OPAQUE or not isinstance(value, np.ndarray) or depth > MAX_DEPTH:
        return
    if value.dtype.names is not None:
        if value.size > MOST_ELEMENTS:
            return
        for k, element in enumerate(value.reshape(-1)):
            at = path if value.size == 1 else (*path[:-1], f"{path[-1]}({k + 1})")
            labels = _labels(element)
            for name in value.dtype.names:
                for part in _parts((*at, name), element[name], depth + 1):
                    yield _labelled(part, labels) if name in ("values", "Data") else part
    elif value.dtype.kind == "O":
        for k, element in enumerate(value.reshape(-1)[:MOST_ELEMENTS]):
            at = path if value.size == 1 else (*path[:-1], f"{path[-1]}{{{k + 1}}}")
            yield from _parts(at, element, depth + 1)
    else:
        yield Part.of(path, value)


def _labels(element: Any) -> tuple[str, ...]:
    """Returns the label of a signal in a Simulink log ("structure with time")."""
    for name in ("label", "Name", "blockName"):
        if name in (element.dtype.names or ()):
            value = np.asarray(element[name])
            if value.size == 1 and value.dtype.kind == "U" and str(value.reshape(-1)[0]).strip():
                return (str(value.reshape(-1)[0]).strip(),)
    return ()


def _labelled(part: Part, labels: tuple[str, ...]) -> Part:
    """Returns a part under the label of its signal; its structure stays the same."""
    if len(labels) != 1:
        return part
    return Part((*part.path[:-2], labels[0]), part.shape, part.dtype, part.read, part.unit)


def object_parts(data: bytes, notes: list[str]) -> list[Part]:
    """Returns the columns of the tables and timetables among the variables of a MAT file.

    What cannot be read is said in `notes`.
    """
    try:
        import matio
    except ModuleNotFoundError:
        notes.append(f"tables and other objects are left out: {install_line('logs')}, or {ADVICE}")
        return []
    with temporary_folder() as folder:  # the reader takes a path only
        file = folder / "log.mat"
        file.write_bytes(data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                content = matio.load_from_mat(str(file), add_table_attrs=True)
        except Exception as error:  # the reader has no common exception
            notes.append(f"tables and other objects are left out ({first_line(error)}): {ADVICE}")
            return []
    parts = [part for name, value in content.items() for part in _of_table(name, value)]
    if not parts:
        notes.append(f"objects that are no tables or timetables are left out: {ADVICE}")
    return parts


def _of_table(name: str, table: Any) -> Iterator[Part]:
    """Yields the columns of a pandas table, and its index where that is a time."""
    if not (hasattr(table, "columns") and hasattr(table, "index")):
        return
    units = table.attrs.get("varUnits")
    index = table.index.to_numpy()
    if index.dtype.kind in "mM":
        yield Part.of((name, str(table.index.name or "Time")), index)
    for k, column in enumerate(table.columns):
        unit = str(units[k]).strip() if units is not None and k < len(units) else ""
        yield Part.of((name, str(column)), table[column].to_numpy(), unit or None)


KIND = Kind(MatTable, ("mat",))
