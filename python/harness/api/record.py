# SPDX-License-Identifier: MIT
"""A record as people handle it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from .. import records
from ..base.arrays import FloatArray
from ..base.files import result_files
from ..catalogue.channels import CHANNELS
from ..records.origin import unit_of
from ..records.writing import format_of, record_bytes
from ..show.page import Table, Told
from ..show.reading_section import reading_blocks
from .frames import Tabular
from .shown import Shown
from .wording import in_python

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
