# SPDX-License-Identifier: MIT
"""Kinds of files: those that are read, told by name or content, and those that are known only.

Each module of `kinds` registers one with its `KIND`.

Makes a record of columns that are in memory, by the rules for files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.error_words import install_line
from ..base.numbers import masked_count
from ..catalogue.channels import CHANNELS
from . import kinds
from .checks import check_columns
from .errors import RecordError
from .logs.log import Kind, Log, Part, Table, series_of
from .mapping import NO_HINTS, Hints, Request
from .reading import record_in
from .record import Record, digest
from .writing import FORMATS, unknown_ending

KINDS: tuple[Kind, ...] = tuple(
    import_module(f"{kinds.__name__}.{one.name}").KIND for one in iter_modules(kinds.__path__)
)
OF_ENDING = {ending: kind for kind in KINDS for ending in kind.endings}
ENDINGS = (*FORMATS, *(one for one in OF_ENDING if one not in FORMATS))
# What is taken for a record in a folder.
FOLDER_ENDINGS = tuple(one for one in ENDINGS if one not in OF_ENDING[one].of_notes)
# Their readers say better than `UNREAD` what such a file is instead.
CHECKED = ("parquet", "mat", "npz")
MATLAB_HEAD = 512  # bytes in front of HDF5 in a MAT file of version 7.3
HEAD_BYTES = 4096
DECODED = (
    "decode its signals with the database of the bus (.dbc) and export them as MF4 or CSV, for "
    "example in CANalyzer or asammdf"
)
UNPACKED = "unpack it, and name the file in it"


class Unread(NamedTuple):
    """A kind of file that is not read."""

    name: str
    """What the file is, for a sentence."""
    endings: tuple[str, ...]
    """Endings that only this kind has."""
    export: str
    """How to make a file of it that is read."""
    head: bytes | None = None
    """Regular expression of its first bytes; None if they are not known."""


UNREAD = (
    Unread("an imc FAMOS file", ("raw",), "export it in imc FAMOS as MATLAB (.mat) or text, or "
           "convert it to CSV with imctermite", rb"\s*\|CF,\d"),
    Unread("a simulation result of LTspice", (), "use File > Export data as text in the window of "
           "the curves", rb"Title:[^\n]*\nDate:[^\n]*\nPlotname:|T\x00i\x00t\x00l\x00e\x00:\x00"),
    Unread("a ULog file of PX4", ("ulg", "ulog"), "convert it with ulog2csv (package pyulog), and "
           "name the CSV file with the signals", rb"ULog\x01\x12\x35"),
    Unread("an ASAM ODS file", ("atf", "atfx", "atfxml"), "export it as MF4 or CSV in the program "
           "that wrote it", rb"(?:\xef\xbb\xbf)?(?:<\?xml[^>]*>\s*)?<atfx_file|ATF_FILE"),
    Unread("a CAN trace (Vector BLF)", ("blf",), DECODED, rb"(?s:LOGG..\x00\x00)"),
    Unread("a CAN trace (Vector ASC)", (), DECODED, rb"date [^\n]*\r?\n\s*base (?:hex|dec)"),
    Unread("a waveform of a LeCroy oscilloscope", (), "save it as text (CSV) on the oscilloscope",
           rb"(?:#\d{1,10})?WAVEDESC"),
    Unread("a CAN trace (PEAK TRC)", ("trc",), DECODED, rb"\s*;\$FILEVERSION"),
    Unread("a CAN trace (candump)", (), DECODED, rb"\s*\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]{3,8}#"),
    Unread("a recording of TwinCAT Scope", ("svdx", "svd"), "export it in TwinCAT Scope as CSV "
           "with a full header, tabs between the columns and the time in ms"),
    Unread("a Dewesoft file", ("dxd", "dxz", "d7d", "d7z", "dewesoft"), "export it in Dewesoft as "
           "MATLAB (.mat) or text (CSV)"),
    Unread("a SoMat SIE file", ("sie",), "export it as text (CSV) in the program that wrote it"),
    Unread("a Yokogawa waveform", ("wdf", "wvf"), "export it as CSV in Xviewer"),
    Unread("an RPC III time history of MTS", ("rsp", "drv", "rpc"), "export it as text (CSV) in "
           "the program that wrote it", rb"FORMAT\x00"),
    Unread("a file in the Standard Data Format (SDF) of an analyser", ("sdf",), "export it as text "
           "(CSV) or MATLAB (.mat) in the program that wrote it"),
    Unread("an HBM Perception recording", ("pnrf",), "export it in Perception as MATLAB (.mat) or "
           "text (CSV)"),
    Unread("a DIAdem TDM file", ("tdm", "tdx"), "save it in DIAdem as TDMS",
           rb"(?:\xef\xbb\xbf)?(?:<\?xml[^>]*>\s*)?<usi:tdm"),
    Unread("the index of a TDMS file", ("tdms_index",), "name the .tdms file beside it", rb"TDSh"),
    Unread("a recording of dSPACE ControlDesk", ("idf",), "export it in ControlDesk as MATLAB "
           "(.mat), MF4 or CSV"),
    Unread("a waveform of a Tektronix oscilloscope", ("isf", "wfm"), "save it as CSV"),
    Unread("a PicoScope file", ("psdata",), "save it in PicoScope as MATLAB (.mat) or CSV"),
    Unread("a WinDaq file", ("wdq", "wdh"), "export it in WinDaq as CSV"),
    Unread("a testXpert file", ("zs2", "zse"), "export it in testXpert as text"),
    Unread("a session of the Simulation Data Inspector", ("mldatx",), "export it there as MATLAB "
           "(.mat)"),
    Unread("a universal file (UFF)", ("uff", "unv"), "export it as text (CSV) or MATLAB (.mat) in "
           "the program that wrote it", rb"\s{4}-1\s*\n\s*(?:58b?|151|164)\s"),
    Unread("a capture of network packets", ("pcap", "pcapng", "cap"), "export the signals in "
           "Wireshark as CSV",
           rb"\xd4\xc3\xb2\xa1|\xa1\xb2\xc3\xd4|\x4d\x3c\xb2\xa1|\x0a\x0d\x0d\x0a"),
    Unread("a Microsoft Access database", ("mdb", "accdb"), "export the table with the signals as "
           "CSV or .xlsx", rb"\x00\x01\x00\x00Standard (?:Jet|ACE) DB"),
    Unread("an SQLite database", ("db", "sqlite", "sqlite3"), "export the table with the signals "
           "as CSV; a ROS 2 bag is named by its folder"),
    Unread("an Arrow or Feather file", ("arrow", "feather"), "write it as Parquet",
           rb"ARROW1\x00\x00"),
    Unread("an array of NumPy", ("npy",), "save its columns by name with numpy.savez",
           rb"\x93NUMPY"),
    Unread("a pickle of Python, which can run code", ("pkl", "pickle"), "save the signals as "
           "Parquet or NPZ"),
    Unread("an archive", ("zip", "7z", "rar", "tar", "tgz", "xz", "bz2", "zst"), UNPACKED,
           rb"7z\xbc\xaf\x27\x1c|Rar!\x1a\x07|BZh\d1AY&SY|\xfd7zXZ\x00|\x28\xb5\x2f\xfd"),
)  # fmt: skip


def kind_of(data: bytes, path: Path, ending: str) -> Kind:
    """Returns the kind of a file, by its first bytes or else by the ending of its name.

    Raises
    ------
    RecordError
        it is of a kind that is not read.
    """
    kind = _told_by_head(data)
    if kind is None and ending == "mat":
        kind = _told_by_head(data[MATLAB_HEAD : MATLAB_HEAD + HEAD_BYTES])
    if kind is None and ending not in CHECKED and (known := _refusal(path, data)) is not None:
        raise known
    return OF_ENDING[ending] if kind is None else kind


def opened(kind: Kind, data: bytes, path: Path) -> Log | Table:
    """Returns what a file of a kind holds; `data` is empty for a folder.

    Raises
    ------
    RecordError
        the file cannot be read; a package that its kind needs is not installed.
    """
    try:
        return kind.read(data, path)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("ehsid"):
            raise
        raise RecordError(
            path,
            f"the package '{error.name}', which reads files of this kind, is not installed",
            expected="the packages that read logs",
            mend=f"install them with: {install_line('logs')}",
        ) from None


def _told_by_head(data: bytes) -> Kind | None:
    return next((kind for kind in KINDS if kind.head and re.match(kind.head, data)), None)


def ending_of(path: Path) -> str:
    """Returns the ending of a file that can be read as a record or a log, in lower case.

    Raises
    ------
    RecordError
        the ending is unknown.
    """
    for ending in ENDINGS:
        if path.name.lower().endswith("." + ending):
            return ending
    if (known := _refusal(path)) is not None:
        raise known
    kind = _told_by_head(_first_bytes(path))
    if kind is None:
        raise unknown_ending(path, sorted(ENDINGS))
    endings = kind.endings or FORMATS[1:2]
    mend = f"rename it to end in .{endings[0]}, because its first bytes are those of such a file"
    raise unknown_ending(path, endings, mend)


def records_in(folder: Path) -> list[Path]:
    """Returns the records and logs of a folder, sorted by name, without those of its sub-folders.

    Hidden files and text files with an ending that a note may have are left out.
    """
    endings = tuple(f".{ending}" for ending in FOLDER_ENDINGS)
    return sorted(
        path
        for path in folder.iterdir()
        if path.is_file() and path.name.lower().endswith(endings) and path.name[0] != "."
    )


def _refusal(path: Path, data: bytes | None = None) -> RecordError | None:
    """Returns the error for a file of a kind that is known but not read; None for any other file.

    Parameters
    ----------
    path
        its name, whose ending tells the kind where the content does not.
    data
        its content, if it has been read already; then only the content counts.
    """
    head = _first_bytes(path) if data is None else data[:HEAD_BYTES]
    known = next((kind for kind in UNREAD if kind.head and re.match(kind.head, head)), None)
    if known is None and data is None:
        ending = path.suffix.lower().removeprefix(".")
        known = next((kind for kind in UNREAD if ending in kind.endings), None)
    if known is None:
        return None
    return RecordError(
        path,
        f"this is {known.name}, which is not read",
        expected="a record, or a log of a kind that is read",
        mend=known.export,
    )


def _first_bytes(path: Path) -> bytes:
    """Returns the first bytes of a file; none if it cannot be read, of which others tell."""
    try:
        with path.open("rb") as file:
            return file.read(HEAD_BYTES)
    except (OSError, ValueError):
        return b""


def record_of_columns(
    columns: Mapping[str, npt.ArrayLike], *, hints: Hints = NO_HINTS, name: str = "record"
) -> Record:
    """Returns the record that a file with these columns would give.

    Parameters
    ----------
    columns
        one-dimensional values of equal length by column name. Columns with the names of the schema
        are in its units. Dates are allowed where they are the time.
    hints
        names, units and sampling time that the user states, as for `read_record`.
    name
        of the record, also in messages.

    Returns
    -------
    The record, without a file as its source; `sha256` is the digest of the columns.

    Raises
    ------
    RecordError
        a column has a problem; the message says where it is and how to mend it.
    """
    given = {str(key): _array(values, str(key), name) for key, values in columns.items()}
    _check(given, name)
    request = Request(None, (), {}, hints)
    record = record_in(_Columns(given, name), Path(name), request, name=name, sha256=None)
    return replace(record, source=None, sha256=digest(given.items()))


class _Columns(Table):
    """Arrays of equal length by name."""

    ending = "columns in memory"
    is_flat = True

    def __init__(self, arrays: Mapping[str, npt.NDArray[Any]], name: str) -> None:
        self._arrays = arrays
        self._name = name

    def names(self) -> list[str] | None:
        dated = any(values.dtype.kind in "mM" for values in self._arrays.values())
        return None if dated else list(self._arrays)

    def text_names(self) -> list[str]:
        return [key for key, values in self._arrays.items() if values.dtype.kind not in "fiubmM"]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        return {name: self._arrays[name] for name in wanted}

    def log(self) -> Log:
        texts = self.text_names()
        for key in texts:
            if key in CHANNELS:
                raise RecordError(
                    self._name,
                    f"the values are of type {self._arrays[key].dtype.name}",
                    column=key,
                    expected="real numbers",
                    mend="convert the column to numbers",
                )
        parts = [Part.of((key,), values) for key, values in self._arrays.items()]
        return Log(self.ending, series_of(parts, Path(self._name)), texts=tuple(texts))


def _array(values: npt.ArrayLike, column: str, name: str) -> npt.NDArray[Any]:
    if isinstance(values, np.ndarray):  # a masked array stays one, so that its mask is seen
        return values
    try:
        return np.asarray(values)
    except ValueError:  # lists of unequal lengths in a list
        raise RecordError(
            name,
            "the values are not one column",
            column=column,
            expected="a vector, one value a sample",
            mend="give each signal under its own name",
        ) from None


def _check(columns: Mapping[str, npt.NDArray[Any]], name: str) -> None:
    if not columns:
        check_columns({}, file=name, first_row=1)
    for key, values in columns.items():
        if masked_count(values):
            check_columns({key: values}, file=name, first_row=1)
        if values.shape[:1] != next(iter(columns.values())).shape[:1]:
            numbers = {one: np.zeros(array.shape) for one, array in columns.items()}
            check_columns(numbers, file=name, first_row=1)
