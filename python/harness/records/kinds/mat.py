# SPDX-License-Identifier: MIT
"""Reads MAT files of version 4 to 7: variables, structures, Simulink logs, tables, dSPACE.

A file of version 7.3 is HDF5 (`hdf5_npz`) behind a head of MATLAB.

The reader of scipy looks up data types by codes from the file without a check, so that a damaged
file can end the process: the elements of a file are checked before it reads them. The layout is
that of "MAT-File Format", The MathWorks, "Level 5".

A recording of dSPACE ControlDesk is one structure with the fields X and Y. X has the axes of time
and Y the signals, each with Name and Data; Y has the number of its axis in XIndex, and its unit in
Unit, where the version of ControlDesk writes them.
"""

from __future__ import annotations

import math
import re
import struct
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...catalogue.channels import TIME
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named
from ..log import Kind, Log, Part, Series, Table, as_float, series_of
from ..units import SECONDS, pint_unit
from .hdf5_npz import object_parts

MAX_DEPTH = 8
MOST_ELEMENTS = 64
# How objects of MATLAB, such as timetables, come out of the reader.
OPAQUE = "MatlabOpaque"
DSPACE = "MAT file of dSPACE ControlDesk"


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
                    "its head says MAT version 7.3, and no HDF5 follows",
                    expected="a whole MAT file of version 4 to 7.3",
                    mend="copy or save it again",
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
        import scipy.sparse

        for name in wanted:
            # It has the dimensions that the file states, however few values it holds.
            if scipy.sparse.issparse(self._variables[name]):
                raise RecordError(
                    self._path,
                    f"the values are a sparse matrix, "
                    f"{' x '.join(map(str, self._variables[name].shape))}",
                    column=name,
                    expected="a vector, one value a sample",
                    mend="store the signal with full(...)",
                )
        return {name: np.asarray(self._variables[name]) for name in wanted}

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
        read, read_time = (partial(as_float, one, label, path) for one in (data, time))
        made.append(Series(label, data.size, read, unit, group, read_time))
    return made


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


MAT = Kind(MatTable, ("mat",))


HEADER_BYTES = 128
# Number of bytes of a value by data type code: miINT8 to miUINT32, miSINGLE, miDOUBLE, miINT64,
# miUINT64, and text as UTF-8, UTF-16 and UTF-32.
WIDTH = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
MATRIX, COMPRESSED = 14, 15
UINT32, INT32 = 6, 5
# Classes from CHAR_CLASS to LAST_NUMERIC_CLASS hold only numbers or text. Cells, structures and
# objects hold arrays.
CHAR_CLASS, SPARSE_CLASS, LAST_NUMERIC_CLASS = 4, 5, 15
COMPLEX_FLAG = 0x800
MOST_NESTED = 30
PIECE_BYTES = 2**20  # of decompressed data, between two looks at the limit
# What an element and a number take in the memory of this process, about.
ELEMENT_BYTES, VALUE_BYTES = 200, 8

Element = tuple[int, memoryview]


class DamagedError(ValueError):
    """The elements are not consistent; the message names the rule that they break."""


def check_elements(data: bytes, check_size: Callable[[int], None]) -> None:
    """Checks codes, sizes and check sums of a file of version 5 to 7; does not check other files.

    `check_size` is called with the number of bytes that the content takes in memory, as far as it
    is known; it raises an error where these are too many, before they are taken.

    Raises
    ------
    DamagedError
        a data type is unknown, an element ends after its container, dimensions do not agree with
        the data, or compressed data are damaged.
    """
    if len(data) < HEADER_BYTES or 0 in data[:4]:
        return  # a file of version 4, or not a MAT file
    if data[126:128] not in (b"IM", b"MI"):
        raise DamagedError("no mark of the byte order in its header")
    order = "<" if data[126:128] == b"IM" else ">"
    if struct.unpack_from(order + "H", data, 124)[0] >> 8 != 1:
        return  # version 7.3
    _Checker(order, check_size).check(memoryview(data)[HEADER_BYTES:])


class _Checker:
    """Checks the elements of one file and counts the memory that its content takes."""

    def __init__(self, order: str, check_size: Callable[[int], None]) -> None:
        self._order = order
        self._check_size = check_size
        self._size = 0

    def check(self, data: memoryview) -> None:
        for code, content in self._elements(data):
            if code == COMPRESSED:
                inner = self._elements(self._decompressed(content))
                if len(inner) != 1:
                    raise DamagedError(f"{len(inner)} variables in one compressed element")
                code, content = inner[0]
            if code != MATRIX:
                raise DamagedError(f"a variable of data type {code}")
            self._check_matrix(content, 1)

    def _add(self, size: int) -> None:
        self._size += size
        self._check_size(self._size)

    def _decompressed(self, content: memoryview) -> memoryview:
        pieces = []
        stream = zlib.decompressobj()
        rest: bytes | memoryview = content
        try:
            while not stream.eof:
                piece = stream.decompress(rest, PIECE_BYTES)
                rest = stream.unconsumed_tail
                if not piece and not stream.eof:
                    raise DamagedError("the data end while decompressing")
                self._add(len(piece))
                pieces.append(piece)
        except zlib.error as error:
            raise DamagedError(str(error)) from None
        return memoryview(b"".join(pieces))

    def _elements(self, data: memoryview) -> list[Element]:
        """Returns data type code and content of each element.

        Elements start at multiples of 8 bytes, but no padding follows compressed ones.
        """
        elements: list[Element] = []
        position = 0
        while position < len(data):
            if len(data) - position < 8:
                raise DamagedError("it ends within an element")
            code, size = struct.unpack_from(self._order + "II", data, position)
            start = position + 8
            if code > 0xFFFF:  # a small element: the tag itself holds up to four bytes of content
                code, size, start = code & 0xFFFF, code >> 16, position + 4
                if size > 4:
                    raise DamagedError(f"a small element of {size} bytes")
            if code not in WIDTH and code not in (MATRIX, COMPRESSED):
                raise DamagedError(f"unknown data type {code}")
            if start + size > len(data):
                raise DamagedError("an element is longer than what holds it")
            self._add(ELEMENT_BYTES)
            elements.append((code, data[start : start + size]))
            position = start + size
            if code != COMPRESSED:
                position += -position % 8
        return elements

    def _check_matrix(self, content: memoryview, depth: int) -> None:
        if not content:
            return  # an empty array in a cell or a structure
        if depth > MOST_NESTED:
            raise DamagedError("arrays within arrays without end")
        parts = self._elements(content)
        if parts[0][0] != UINT32 or len(parts[0][1]) != 8:
            raise DamagedError("an array without flags")
        flags = struct.unpack(self._order + "II", parts[0][1])[0]
        array_class = flags & 0xFF
        if array_class > LAST_NUMERIC_CLASS:
            self._check_inner(parts, depth)  # functions and objects have another layout
            return
        if (
            len(parts) < 3
            or parts[1][0] not in (INT32, UINT32)
            or len(parts[1][1]) % 4
            or not parts[1][1]
        ):
            raise DamagedError("an array without dimensions and name")
        if parts[2][0] not in WIDTH:
            raise DamagedError("an array whose name is an array")
        dimensions = struct.unpack(f"{self._order}{len(parts[1][1]) // 4}i", parts[1][1])
        if min(dimensions) < 0:
            raise DamagedError("a negative dimension")
        if array_class >= CHAR_CLASS:
            expected_parts = (3 if array_class == SPARSE_CLASS else 1) + bool(flags & COMPLEX_FLAG)
            if len(parts) - 3 != expected_parts:
                raise DamagedError(
                    f"an array in {len(parts) - 3} parts instead of {expected_parts}"
                )
            self._check_numbers(parts[3:], array_class, math.prod(dimensions))
        else:
            self._check_inner(parts[3:], depth)

    def _check_numbers(self, parts: list[Element], array_class: int, expected: int) -> None:
        for code, content in parts:
            if code not in WIDTH:
                raise DamagedError("an array of numbers that holds arrays")
            # The size is not checked for text, which may have fewer bytes than letters, and for
            # sparse matrices, whose number of values does not follow from the dimensions.
            if array_class > SPARSE_CLASS and len(content) != expected * WIDTH[code]:
                raise DamagedError(f"{len(content)} bytes for {expected} numbers")
        if array_class != SPARSE_CLASS:
            self._add(expected * len(parts) * VALUE_BYTES)

    def _check_inner(self, parts: list[Element], depth: int) -> None:
        for code, content in parts:
            if code == MATRIX:
                self._check_matrix(content, depth + 1)
