# SPDX-License-Identifier: MIT
"""Reads files of named arrays: HDF5, which MAT files of version 7.3 are, too, and NPZ of NumPy.

Attributes of a dataset may change its values, by the convention of netCDF: value = stored *
scale_factor + add_offset. `_FillValue`, `missing_value` and the valid range are in the numbers that
are stored, and tell which of them are no values. Python objects in an NPZ file stay packed.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.error_words import install_line
from ...base.files import temporary_folder
from ..errors import BYTES, COLUMNS, RecordError, damage_named, first_line
from ..log import SEPARATOR, Kind, Log, Part, Table, series_of

# As in MAT files before version 7.3.
MOST_DEPTH, MOST_CELLS = 3, 64
UNIT_NAMES = ("unit", "units", "Unit", "Units", "UNIT", "UNITS")
_INTEGERS = (f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
NUMERIC_CLASSES = frozenset(["double", "single", "logical", *_INTEGERS])

Unpack = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]

SCALES = ("scalefactor", "addoffset")
MISSING = ("fillvalue", "missingvalue")
RANGES = ("validmin", "validmax", "validrange")
# Attributes of other conventions, whose formula is not known.
UNKNOWN = ("scale", "scaling", "gain", "factor", "slope", "multiplier", "offset", "intercept",
           "bias", "calibration", "unsigned")  # fmt: skip
NEUTRAL = (0.0, 1.0)
ADVICE = (
    "save its numbers in MATLAB, such as s.time_s = seconds(T.Time); s.position_m = T.Position; "
    "or write it with parquetwrite or writetimetable"
)


def read_hdf5(data: bytes, path: Path) -> Log:
    """Returns the datasets of numbers as a log, with their paths as names.

    Links to other files are not followed.
    """
    import h5py

    notes: list[str] = []
    parts: list[Part] = []
    objects: list[str] = []
    with damage_named(path, "HDF5"):
        file = h5py.File(BytesIO(data), "r")
        is_mat = b"MATLAB" in data[:16]

        def visit(name: str, item: Any) -> None:
            if not name.startswith("#"):
                for inner, dataset in _datasets(file, name, item, MOST_DEPTH):
                    COLUMNS.check(len(parts), path)
                    parts.extend(_parts(inner, dataset, path, objects, notes))

        file.visititems(visit)
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
    import h5py

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
    fields = dataset.dtype.names or ()
    return [
        Part((*where, one), dataset.shape, dataset.dtype[one],
             partial(_values, dataset, one, unpack, path))
        for one in fields
    ] or [Part(where, dataset.shape, dataset.dtype,
               partial(_values, dataset, None, unpack, path), unit)]  # fmt: skip


def _content_bytes(file: Any) -> int:
    """Returns how many bytes all datasets have without compression."""
    import h5py

    sizes: list[int] = []

    def visit(_: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            sizes.append(int(item.size) * item.dtype.itemsize)

    file.visititems(visit)
    return sum(sizes)


def _values(dataset: Any, field: str | None, unpack: Unpack, path: Path) -> npt.NDArray[Any]:
    BYTES.check(int(dataset.size) * 8, path)
    with damage_named(path, "HDF5"):
        stored = np.asarray(dataset[()] if field is None else dataset[field])
    return unpack(stored)


def _text(value: Any) -> str | None:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else None


def unpacking(attributes: Mapping[str, Any], name: str, path: Path, notes: list[str]) -> Unpack:
    """Returns what makes values of the stored numbers of a dataset, and adds a note on it.

    It raises RecordError where an attribute cannot be applied, once the dataset is read.
    """
    known: dict[str, tuple[str, npt.NDArray[np.float64] | None]] = {}
    foreign = []
    for key in attributes:
        plain = "".join(c for c in key.casefold() if c.isalnum())
        if plain in (*SCALES, *MISSING, *RANGES):
            known[plain] = key, _numbers(attributes[key])
        elif plain in UNKNOWN:
            found = _numbers(attributes[key])
            if found is None or not np.isin(found, NEUTRAL).all():
                foreign.append(f"{key} = {str(attributes[key])[:40]}")
    if foreign:
        notes.append(
            f"'{name}' has attributes of unknown meaning, which are not applied: "
            + ", ".join(foreign)
        )
    if not known:
        return lambda stored: stored
    sizes = {**dict.fromkeys((*SCALES, "validmin", "validmax"), 1), "validrange": 2}
    bad = [key for plain, (key, found) in known.items()
           if found is None or found.size != sizes.get(plain, found.size)]  # fmt: skip
    if not bad:
        words = (f"{key} = {', '.join(f'{x:.9g}' for x in v)}"
                 for key, v in known.values() if v is not None)  # fmt: skip
        notes.append(f"'{name}': attributes of the file are applied: {'; '.join(words)}")

    def unpack(stored: npt.NDArray[Any]) -> npt.NDArray[Any]:
        if bad:
            raise RecordError(
                path,
                f"the attribute {bad[0]}, which changes the values, is not understood: "
                f"{str(attributes[bad[0]])[:60]}",
                column=name,
                expected="one number (two for a valid range)",
                mend="apply it before the export, and remove the attribute",
            )
        if stored.dtype.kind not in "fiub":
            return stored
        of = {plain: found for plain, (_, found) in known.items() if found is not None}
        values = stored.astype(np.float64)
        low, high = of.get("validrange", (-np.inf, np.inf))
        low, high = of.get("validmin", [low])[0], of.get("validmax", [high])[0]
        missing = (values < low) | (values > high)
        for plain in MISSING:
            # As float32 stores it, a number such as 9.96921e36 is not the one of the attribute.
            given = of.get(plain, np.empty(0))
            missing |= np.isin(values, given) | np.isin(values, given.astype(np.float32))
        values = values * of.get("scalefactor", [1.0])[0] + of.get("addoffset", [0.0])[0]
        values[missing] = np.nan
        return values

    return unpack


def _numbers(value: Any) -> npt.NDArray[np.float64] | None:
    """Returns the numbers of an attribute, which may be a number, an array, or text; else None."""
    if isinstance(value, bytes):
        value = value.decode("ascii", "replace")
    try:
        found = np.asarray(value).reshape(-1).astype(np.float64)
    except (TypeError, ValueError):
        return None
    return found if found.size else None


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


HDF5 = Kind(read_hdf5, ("h5", "hdf5", "hdf"), rb"\x89HDF\r\n\x1a\n")


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


NPZ = Kind(NpzTable, ("npz",))
