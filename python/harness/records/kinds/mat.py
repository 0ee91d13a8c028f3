# SPDX-License-Identifier: MIT
"""Reads MAT files of version 4 to 7: variables, structures, Simulink logs, tables, dSPACE.

A file of version 7.3 is HDF5 (`hdf5`) behind a head of MATLAB.

A recording of dSPACE ControlDesk is one structure with the fields X and Y. X has the axes of time
and Y the signals, each with Name and Data; Y has the number of its axis in XIndex, and its unit in
Unit, where the version of ControlDesk writes them.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.error_words import install_line
from ...base.files import temporary_folder
from ...base.numbers import FloatArray
from ...catalogue.channels import TIME
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named, first_line
from ..logs.log import Kind, Log, Part, Series, Table, as_float, series_of
from ..logs.units import SECONDS, pint_unit
from ..mat_elements import check_elements

MAX_DEPTH = 8
MOST_ELEMENTS = 64
# How objects of MATLAB, such as timetables, come out of the reader.
OPAQUE = "MatlabOpaque"
DSPACE = "MAT file of dSPACE ControlDesk"
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
        with damage_named(path, "MAT"), warnings.catch_warnings():
            check_elements(data, partial(BYTES.check, file=path))
            # scipy 1.18 warns that sparse variables will be of another class. This does not matter
            # here, because all sparse variables are refused.
            warnings.filterwarnings("ignore", ".*`spmatrix`", DeprecationWarning)
            # All objects of MATLAB, such as timetables, are called "None" by this reader.
            warnings.filterwarnings("ignore", "Duplicate variable name .None.")
            # Some versions of the type stubs accept only paths; the function reads any binary file.
            file: Any = BytesIO(data)
            try:
                content = scipy.io.loadmat(file)
            except NotImplementedError:
                raise RecordError(
                    path,
                    "this is a MAT file of version 7.3 (HDF5), which is not read",
                    expected="a MAT file of version 4 to 7",
                    mend="save it in MATLAB with save('name.mat', '-v7')",
                ) from None
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
        recorded = {name: v for name, v in self._variables.items() if _is_recording(v)}
        if recorded and recorded.keys() == self._variables.keys():
            series = [
                one
                for name, value in recorded.items()
                for one in _series_of_recording(
                    value, self._path, notes, within=f"{name}." if len(recorded) > 1 else ""
                )
            ]
            return Log(DSPACE, tuple(series), 1, tuple(notes))
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
            # The label of a signal in a Simulink log ("structure with time").
            fields = ("label", "Name", "blockName")
            label = next((said for one in fields if (said := _text(element, one))), "")
            for name in value.dtype.names:
                for part in _parts((*at, name), element[name], depth + 1):
                    labelled = label and name in ("values", "Data")
                    yield replace(part, path=(*part.path[:-2], label)) if labelled else part
    elif value.dtype.kind == "O":
        for k, element in enumerate(value.reshape(-1)[:MOST_ELEMENTS]):
            at = path if value.size == 1 else (*path[:-1], f"{path[-1]}{{{k + 1}}}")
            yield from _parts(at, element, depth + 1)
    else:
        yield Part.of(path, value)


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


def _is_recording(value: Any) -> bool:
    """Whether a variable is a recording of ControlDesk."""
    fields = getattr(getattr(value, "dtype", None), "names", None) or ()
    if not {"X", "Y"} <= set(fields) or value.size != 1:
        return False
    inner = (value.reshape(-1)[0][name] for name in ("X", "Y"))
    return all({"Name", "Data"} <= set(one.dtype.names or ()) and one.size for one in inner)


def _series_of_recording(
    value: Any, path: Path, notes: list[str], *, within: str = ""
) -> list[Series]:
    """Returns the signals of a recording, each with its time; `within` precedes their names.

    Raises
    ------
    RecordError
        a signal has no axis of its length, or the unit of its time is none.
    """
    axes, signals = (list(value.reshape(-1)[0][name].reshape(-1)) for name in ("X", "Y"))
    COLUMNS.check(len(signals), path)
    times = [np.asarray(one["Data"]).reshape(-1) for one in axes]
    names = [_name(one) or f"Y({k})" for k, one in enumerate(signals, start=1)]
    repeated = {name for name, count in Counter(names).items() if count > 1}
    first = min((int(index) for one in signals if (index := _number(one, "XIndex")) is not None),
                default=1)  # fmt: skip
    made = []
    for name, one in zip(names, signals, strict=True):
        data = np.asarray(one["Data"]).reshape(-1)
        label = within + (f"{_text(one, 'Path')}/{name}" if name in repeated else name)
        if data.size < 2 or data.dtype.kind not in "fiub":
            notes.append(f"'{label}' is left out: it holds no series of numbers")
            continue
        SAMPLES.check(data.size, path)
        axis = _axis(one, data.size, times, min(first, 1), label, path)
        time = times[axis] * _seconds(_text(axes[axis], "Unit"), label, path)
        unit, group = _text(one, "Unit") or None, f"{within}X({axis + 1})"
        made.append(_recorded(label, data, time, unit, group, path))
    return made


def _recorded(
    name: str, data: Any, time: FloatArray, unit: str | None, group: str, path: Path
) -> Series:
    return Series(
        name,
        data.size,
        lambda: as_float(data, name, path),
        unit,
        group,
        time=lambda: as_float(time, name, path),
    )


def _axis(signal: Any, size: int, times: Sequence[Any], first: int, name: str, path: Path) -> int:
    """Returns the number of the axis of a signal, from 0: the one of XIndex, or of its length."""
    fitting = [k for k, one in enumerate(times) if one.size == size]
    stated = _number(signal, "XIndex")
    if stated is not None and int(stated) - first in fitting:
        return int(stated) - first
    if len(fitting) == 1:
        return fitting[0]
    raise RecordError(
        path,
        f"{len(fitting) or 'none'} of the {len(times)} axes X of this recording of dSPACE "
        f"ControlDesk fit the {size} values",
        column=name,
        expected="one axis of time for each signal in Y",
        mend="record the signals with one raster, or export them as CSV",
    )


def _seconds(unit: str, name: str, path: Path) -> float:
    known = pint_unit(unit, TIME) if unit else "s"
    if known not in SECONDS:
        raise RecordError(
            path,
            f"its axis X has the unit '{unit}', which is none of time",
            column=name,
            expected=f"one of {', '.join(SECONDS)}",
            mend="record it over time",
        )
    return SECONDS[known]


def _name(signal: Any) -> str:
    """Returns the name of a signal; that of a port, "Model/Valve/Out1", is the one of its block."""
    return re.sub(r"(?<=.)/(?:Out|In)\d+$", "", _text(signal, "Name").replace('"', ""))


def _text(element: Any, field: str) -> str:
    """Returns a field that holds text; empty where there is none."""
    value = element[field] if field in (element.dtype.names or ()) else np.array("")
    return str(value.reshape(-1)[0]).strip() if value.size == 1 and value.dtype.kind == "U" else ""


def _number(element: Any, field: str) -> float | None:
    """Returns a field that holds one number; None where there is none."""
    value = element[field] if field in (element.dtype.names or ()) else np.array([])
    return float(value.reshape(-1)[0]) if value.size == 1 and value.dtype.kind in "fiu" else None


KIND = Kind(MatTable, ("mat",))
