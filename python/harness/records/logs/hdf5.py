# SPDX-License-Identifier: MIT
"""Reads logs from HDF5 files, and from MAT files of version 7.3, which are HDF5."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from ..errors import RecordError, damaged
from ..limits import BYTES, COLUMNS
from .arrays import SEPARATOR, Part, series_of
from .log import Log
from .matlab_objects import object_parts
from .packing import Unpack, unpacking

# As in MAT files before version 7.3.
MOST_DEPTH, MOST_CELLS = 3, 64
UNIT_NAMES = ("unit", "units", "Unit", "Units", "UNIT", "UNITS")
_INTEGERS = (f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
NUMERIC_CLASSES = frozenset(["double", "single", "logical", *_INTEGERS])


def read(data: bytes, path: Path) -> Log:
    """Returns the datasets of numbers as a log, with their paths as names.

    Links to other files are not followed.

    Raises
    ------
    RecordError
        the file is damaged or beyond a limit.
    """
    notes: list[str] = []
    parts: list[Part] = []
    objects: list[str] = []
    try:
        file = h5py.File(BytesIO(data), "r")
        is_mat = b"MATLAB" in data[:16]

        def visit(name: str, item: Any) -> None:
            if not name.startswith("#"):
                for inner, dataset in _datasets(file, name, item, MOST_DEPTH):
                    COLUMNS.check(len(parts), path)
                    parts.extend(_parts(inner, dataset, path, objects, notes))

        file.visititems(visit)
    except RecordError:
        raise
    except Exception as error:  # OSError, RuntimeError, KeyError, as the damage is
        raise damaged(path, "HDF5", error) from None
    if objects:
        BYTES.check(_content_bytes(file), path)
        parts += object_parts(data, notes)
    kind = "MAT file of version 7.3 (HDF5)" if is_mat else "HDF5"
    return Log(kind, series_of(parts, path), 1, tuple(notes))


def _datasets(file: Any, name: str, item: Any, depth: int) -> Iterator[tuple[str, Any]]:
    """Yields a dataset, or those that it refers to: the cells of MATLAB's cell and struct arrays.

    Cells beyond MOST_CELLS, and cells in cells below `depth`, are no signals and are left out, as
    are the parts of sparse matrices.
    """
    if not isinstance(item, h5py.Dataset) or "MATLAB_sparse" in item.parent.attrs:
        return
    if h5py.check_ref_dtype(item.dtype) is not h5py.Reference:
        yield name, item
        return
    if depth == 0 or "MATLAB_object_decode" in item.attrs:
        return
    for k, reference in enumerate(item[()].reshape(-1)[:MOST_CELLS]):
        if not reference:
            continue
        at = name if item.size == 1 else f"{name}{{{k + 1}}}"
        cell = file[reference]
        if isinstance(cell, h5py.Group):
            for field in list(cell)[:MOST_CELLS]:
                yield from _datasets(file, f"{at}/{field}", cell[field], depth - 1)
        else:
            yield from _datasets(file, at, cell, depth - 1)


def _parts(name: str, dataset: Any, path: Path, objects: list[str], notes: list[str]) -> list[Part]:
    where = tuple(name.split("/"))
    of_matlab = _text(dataset.attrs.get("MATLAB_class"))
    if of_matlab is not None and of_matlab not in NUMERIC_CLASSES:
        if "MATLAB_object_decode" in dataset.attrs and len(where) == 1:
            objects.append(name)
        return []
    if dataset.is_virtual or dataset.external or "MATLAB_empty" in dataset.attrs:
        return []
    unit = next((u for key in UNIT_NAMES if (u := _text(dataset.attrs.get(key)))), None)
    unpack = unpacking(dict(dataset.attrs), SEPARATOR.join(where), path, notes)
    if dataset.dtype.names:
        return [
            Part(
                (*where, field),
                dataset.shape,
                dataset.dtype[field],
                partial(_values, dataset, field, unpack, path),
            )
            for field in dataset.dtype.names
        ]
    read_all = partial(_values, dataset, None, unpack, path)
    return [Part(where, dataset.shape, dataset.dtype, read_all, unit)]


def _content_bytes(file: Any) -> int:
    """Returns how many bytes all datasets have without compression."""
    sizes: list[int] = []

    def visit(_: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            sizes.append(int(item.size) * item.dtype.itemsize)

    file.visititems(visit)
    return sum(sizes)


def _values(dataset: Any, field: str | None, unpack: Unpack, path: Path) -> npt.NDArray[Any]:
    BYTES.check(int(dataset.size) * 8, path)
    try:
        stored = np.asarray(dataset[()] if field is None else dataset[field])
    except Exception as error:  # as in `read`
        raise damaged(path, "HDF5", error) from None
    return unpack(stored)


def _text(value: Any) -> str | None:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else None
