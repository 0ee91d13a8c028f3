# SPDX-License-Identifier: MIT
"""One input and one output, of whatever the caller has."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from ..base.text import printable
from ..catalogue.channels import CHANNELS, TIME
from ..models.identification import IoData
from ..records import Origin, read_record
from .read import Source, record_of
from .wording import log_reading

Arrays = tuple[npt.ArrayLike, npt.ArrayLike, float | None]
"""Input, output and sampling time in seconds."""


@dataclass(frozen=True)
class Signals:
    """Input and output with what is known of them.

    Attributes
    ----------
    data
        the samples.
    name
        of the record.
    origin
        how a log became the record; None for a record or arrays.
    source
        file of the record; None for one in memory.
    """

    data: IoData
    name: str
    origin: Origin | None = None
    source: Path | None = None

    @property
    def inputs(self) -> list[Path]:
        """Files that no result may replace."""
        return [] if self.source is None else [self.source]

    @property
    def output_label(self) -> str:
        """Name of the output with its unit, for an axis."""
        name = self.data.output_name
        return f"{name} in {CHANNELS[name].unit}" if name in CHANNELS else printable(name)


def signals_of(
    source: Source | Arrays | npt.ArrayLike,
    input: str,
    output: str,
    arrays: Sequence[object] = (),
) -> Signals:
    """Returns input and output of a record, or of arrays.

    Parameters
    ----------
    source
        as `read` takes it, a record, or the tuple (u, y, dt_s). Of a file only the two columns are
        read, as the commands do.
    input, output
        names of the columns; for arrays, of the signals in messages.
    arrays
        what follows the first of plain arrays: (y, dt_s), where `source` is u.

    Raises
    ------
    ValueError
        the record has a problem or lacks a column; both names are the same, or that of the time.
    """
    if arrays or isinstance(source, tuple):
        given = cast(tuple[Any, ...], (source, *arrays) if arrays else source)
        if len(given) != 3:
            raise ValueError(
                f"{len(given)} arguments or entries of a tuple: expected u, y, dt_s, with None for "
                "dt_s where the sampling time is not known; pass options by name"
            )
        u, y, dt_s = given
        number = isinstance(dt_s, int | float | np.number)
        if dt_s is not None and not (number and 0.0 < dt_s < float("inf")):
            raise ValueError(f"dt_s = {dt_s!r}: expected a sampling time in seconds, above 0")
        return Signals(IoData.from_arrays(u, y, dt_s=dt_s), "arrays")
    if input == output or TIME in (input, output):
        raise ValueError(
            f"input={input!r}, output={output!r}: expected two columns, neither of them the time; "
            "name the command as the input and the measured signal as the output"
        )
    if isinstance(source, str | os.PathLike):
        record = read_record(source, columns=[input, output])
        log_reading(record)
    else:
        record = record_of(cast(Source, source))
    data = IoData.from_record(record, input, output)
    return Signals(data, record.name, record.origin, record.source)


@contextmanager
def about(signals: Signals) -> Iterator[None]:
    """Puts the file or the name of the record in front of the message of a ValueError."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{signals.source or signals.name}: {error}") from error
