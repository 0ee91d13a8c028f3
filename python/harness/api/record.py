# SPDX-License-Identifier: MIT
"""A record as people handle it.

Reads records from files and from memory.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .. import records
from ..base.files import result_files
from ..base.numbers import FloatArray
from ..catalogue.channels import CHANNELS, TIME
from ..records import NO_HINTS, Hints, read_record
from ..records.mapping import parse_maps
from ..records.reading import record_of_columns
from ..records.record import format_of, record_bytes, unit_of
from ..show.page import Table, Told
from ..show.where_section import reading_blocks
from .tables import Columns, Shown, Tabular, columns_of
from .wording import in_python, log_reading

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Columns with a name in the line of a record; the table has all.
MOST_NAMED = 8


class Record(Shown, Tabular):
    """Uniform samples of named columns; `read` makes it.

    Attributes
    ----------
    result
        the record as the rooms of the harness have it, `ehsid.harness.records.Record`.
    """

    def __init__(self, result: records.Record) -> None:
        self.result = result

    @property
    def name(self) -> str:
        """Stem of the file, or the name that was given."""
        return self.result.name

    @property
    def dt_s(self) -> float | None:
        """Sampling time in seconds; None if it is not known."""
        return self.result.dt_s

    @property
    def time_s(self) -> FloatArray | None:
        """Time in seconds, shape (n,); None if it is not known."""
        return self.result.time_s

    @property
    def columns(self) -> Mapping[str, FloatArray]:
        """Columns by name without the time, each of shape (n,), those of the schema in SI units."""
        return self.result.columns

    def __len__(self) -> int:
        """Number of samples, as in a frame."""
        return len(self.result)

    def __iter__(self) -> Iterator[str]:
        """Yields the names of the columns, as a frame does."""
        return iter(self.columns)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> FloatArray:
        """Returns a column, shape (n,).

        Raises
        ------
        ValueError
            there is no such column; the message suggests the nearest name.
        """
        return self.result.column(name)

    def plot(self) -> Figure:
        """Returns a figure of the channels over time; of a record without any, its columns."""
        from ..show.record_figure import record_figure

        return record_figure(self.result)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the record as `ehsid import --out` does, and returns the path.

        Parameters
        ----------
        path
            file whose ending says the format: .parquet, .csv, .csv.gz, .mat or .npz. A file that
            ehsid did not write is not replaced.

        Raises
        ------
        ValueError
            the ending is another one, or the file cannot be written there.
        """
        out = Path(path)
        source = self.result.source
        with in_python():
            format_of(out)
            with result_files(out, "import", inputs=[] if source is None else [source]) as new:
                (new / out.name).write_bytes(record_bytes(self.result, out.name))
        return out

    def _columns(self) -> Mapping[str, FloatArray]:
        time_s = {} if self.time_s is None else {"time_s": self.time_s}
        return {**time_s, **self.columns}

    def _line(self) -> str:
        step = "no time" if self.dt_s is None else f"every {self.dt_s:.6g} s"
        pieces = len(self.result.segments)
        names = list(map(_with_unit, list(self.columns)[:MOST_NAMED]))
        more = [f"{len(self.columns) - MOST_NAMED} more"] if len(self.columns) > MOST_NAMED else []
        return (
            f"{self.name}, {len(self)} samples, {step}"
            + (f", in {pieces} pieces" if pieces > 1 else "")
            + f"; {', '.join(names + more)}"
        )

    def _blocks(self) -> Sequence[Told]:
        rows = [
            (name, unit_of(name), f"{values.min():.5g}", f"{values.max():.5g}")
            for name, values in self.columns.items()
        ]
        ranges = Table("", ("column", "unit", "lowest", "highest"), rows)
        origin = self.result.origin
        return [ranges, self._line(), *([] if origin is None else reading_blocks(origin))]


def _with_unit(name: str) -> str:
    if name not in CHANNELS:
        return name
    unit = CHANNELS[name].unit
    return f"{name} as a fraction" if unit == "1" else f"{name} in {unit}"


Source = str | os.PathLike[str] | Columns | Record | records.Record
"""What is taken for a record: a path, columns in memory, or a record."""


def read(
    source: Source,
    *,
    maps: Mapping[str, str] | None = None,
    dt_s: float | None = None,
    name: str | None = None,
) -> Record:
    """Reads and checks a record, from a file of any kind or from memory.

    Columns with the names of the schema (docs/records.md) are taken as they are. In every other
    layout the channels are found by names, units and ranges; the logger `ehsid` tells what was
    taken for what, and `Record.summary` does so, too.

    Parameters
    ----------
    source
        path of a log; columns in memory: a mapping of arrays of shape (n,) by name, or a DataFrame
        of polars or pandas; or a record, to be resampled or renamed.
    maps
        columns for channels, with their units: {"position_m": "Weg [mm]"}.
    dt_s
        sampling time in seconds, above 0: of rows without time, else that to which the record is
        resampled.
    name
        name of the record; without it the stem of the file, or "record".

    Raises
    ------
    ValueError
        the source has a problem; the message says where, what was expected, and how to mend it.

    Examples
    --------
    >>> import ehsid
    >>> ehsid.read("examples/data/hydraulic_crane.csv")
    <ehsid.Record: hydraulic_crane, 1024 samples, no time; sample, valve_opening, oil_pressure>
    >>> log = {"Weg": [10.0, 10.5, 11.5], "u": [0.0, 1.0, 1.0]}
    >>> ehsid.read(log, maps={"position_m": "Weg [mm]", "command_v": "u"}, dt_s=0.001)
    <ehsid.Record: record, 3 samples, every 0.001 s; command_v in V, position_m in m>
    """
    with in_python():
        hints = hints_of(maps, dt_s)
        result = _result(source, hints, name or "record")
    if name is not None:
        result = replace(result, name=name)
    log_reading(result)
    return Record(result)


def _result(source: Source, hints: Hints, name: str) -> records.Record:
    if isinstance(source, str | os.PathLike):
        return read_record(source, required=(), hints=hints)
    if not isinstance(source, Record | records.Record):
        return record_of_columns(columns_of(source), hints=hints, name=name)
    record = record_of(source)
    if not hints:
        return record
    time_s = {} if record.time_s is None else {TIME: record.time_s}
    made = record_of_columns({**time_s, **record.columns}, hints=hints, name=record.name)
    return replace(made, source=record.source)


def hints_of(maps: Mapping[str, str] | None, dt_s: float | None) -> Hints:
    """Returns what the caller says about a log.

    Raises
    ------
    ValueError
        a map names no channel or no unit of it, or the sampling time is not above 0.
    """
    if dt_s is not None and not 0.0 < dt_s < float("inf"):
        raise ValueError(f"dt_s = {dt_s:g}: expected a sampling time in seconds, above 0")
    if not maps and dt_s is None:
        return NO_HINTS
    texts = [f"{channel}={column}" for channel, column in (maps or {}).items()]
    return Hints(parse_maps(texts, "maps"), dt_s)


def record_of(source: Source) -> records.Record:
    """Returns a record as the rooms have it, of whatever is taken for one.

    Raises
    ------
    ValueError
        as `read`.
    """
    if isinstance(source, records.Record):
        return source
    return source.result if isinstance(source, Record) else read(source).result
