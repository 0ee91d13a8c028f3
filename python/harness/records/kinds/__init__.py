# SPDX-License-Identifier: MIT
"""Kinds of files: those that are read, told by name or content, and those that are known only.

A module of this folder registers those that it reads by constants of the type `Kind`. It is
imported before they are needed; it imports its library only where it reads a file.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import NamedTuple

from ..errors import RecordError, bounded_memory, decompress, missing_package, read_file
from ..log import Kind, Log, Table
from ..record import FORMATS, unknown_ending

_BY_NAME = {
    name: one
    for module in iter_modules(__path__, f"{__name__}.")
    for name, one in vars(import_module(module.name)).items()
    if isinstance(one, Kind)
}
KINDS = tuple(_BY_NAME[name] for name in sorted(_BY_NAME))
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


@contextmanager
def opened(path: Path) -> Iterator[tuple[Log | Table, str, str]]:
    """Opens a file for as long as the block lasts; gives its name and its SHA-256 digest, too."""
    if path.is_dir() and not (path / "metadata.yaml").is_file():  # a bag of ROS 2 has it
        raise RecordError(
            path,
            "this is a directory",
            expected="a record file",
            mend="name one of the files in it",
        )
    ending = "db3" if path.is_dir() else ending_of(path)
    # Without its ending: "run.csv.gz" gives "run".
    name = path.name if path.is_dir() else path.name[: -len(ending) - 1]
    data, sha256 = _bytes(path)
    if ending.endswith(".gz"):
        data = decompress(data, path)
    kind = kind_of(data, path, ending)
    with bounded_memory(path) if kind.unbounded else nullcontext():
        try:
            content = kind.read(data, path)
        except ModuleNotFoundError as error:
            if error.name is None or error.name.startswith("ehsid"):
                raise
            raise missing_package(path, error.name, "reads") from None
        yield content, name, sha256


def _bytes(path: Path) -> tuple[bytes, str]:
    """Returns the content of a file and its SHA-256; of a folder its digest only."""
    try:
        if "\0" in str(path):
            problem, mend = "the path has a zero byte", "check the path"
        elif path.is_dir():
            files = sorted(file for file in path.iterdir() if file.is_file())
            contents = [read_file(file) for file in files]
            return b"", hashlib.sha256(b"".join(contents)).hexdigest()
        else:
            data = read_file(path)
            return data, hashlib.sha256(data).hexdigest()
    except FileNotFoundError:
        problem, mend = "there is no such file", "check the path"
    except OSError as error:
        problem, mend = f"the file cannot be read ({error.strerror})", "check its permissions"
    raise RecordError(path, problem, expected="a record file", mend=mend)


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

    Where `data`, its content, has been read already, only the content counts; else its ending, too.
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
