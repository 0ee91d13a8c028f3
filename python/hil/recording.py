# SPDX-License-Identifier: MIT
"""Writes the record and the estimates of a run while it goes on.

Each sample is written to both files as one whole line in one call. If the program is interrupted,
they end with the previous sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import BinaryIO, Self

from ehsid.harness.models.identification import ArxOrders

from .answers import Result, SampleAnswer, ServoResult
from .cycles import Cycles
from .session import Counters

RECORD = "record.csv"
ESTIMATES = "estimates.csv"


def _columns(answer: type[SampleAnswer]) -> tuple[str, ...]:
    """Fields of the answer from the gain to the cycles."""
    names = [field.name for field in fields(answer)]
    return tuple(names[names.index("gain_v_m") : names.index("step_cycles") + 1])


_FRONT, _BEHIND = ("time_s", "reference_m"), ("asked_again", "bad_frames", "trips", "restarts")
_CYCLES = ("cycles_lost", "overrun")  # cycles lost right before the sample, and 0 or 1


class Table:
    """A CSV file to which whole lines are appended."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        # Without a buffer the operating system has the line as soon as write() returns.
        self._file: BinaryIO = path.open("wb", buffering=0)
        self._write(columns)

    def add(self, numbers: Sequence[float | int]) -> None:
        """Appends a row; the numbers are written so that reading gives the same float64."""
        self._write([repr(x) if isinstance(x, float) else str(int(x)) for x in numbers])

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def _write(self, cells: Sequence[str]) -> None:
        self._file.write((",".join(cells) + "\n").encode("ascii"))


class Recording:
    """Writes the two files of a run, record.csv and estimates.csv, from its first sample on.

    The record has the position sent to the target and the command in its answer, both rounded to
    float32, so that a replay reproduces the target bit for bit. A run without a sample leaves
    neither files nor an empty folder.

    Parameters
    ----------
    folder, outputs
        where the files are written, and the measured outputs of the record.
    orders
        of the estimator; None for a ServoEstimator.
    cycles
        of the plan; those that are not regular add two columns to the estimates.

    Attributes
    ----------
    samples
        number of samples written so far.
    """

    def __init__(
        self,
        folder: Path,
        outputs: Sequence[str],
        orders: ArxOrders | None,
        cycles: Cycles | None = None,
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.samples = 0
        self._folder = folder
        self._outputs = tuple(outputs)
        self._cycles, self._last = cycles, -1
        self._answer = _columns(ServoResult if orders is None else Result)
        self._record = Table(folder / RECORD, ("time_s", "command_v", *self._outputs))
        try:
            names = (*(_CYCLES if cycles else ()), *(orders.names if orders else ()))
            columns = (*_FRONT, *self._answer, *_BEHIND, *names)
            self._estimates = Table(folder / ESTIMATES, columns)
        except OSError:
            self._record.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._record.close()
        self._estimates.close()
        if self.samples == 0:
            for name in (RECORD, ESTIMATES):
                (self._folder / name).unlink()
            with suppress(OSError):  # holds other files
                self._folder.rmdir()

    def add(
        self,
        time_s: float,
        outputs: Mapping[str, float],
        reference_m: float,
        result: SampleAnswer,
        counters: Counters,
        restarts: int,
    ) -> None:
        """Appends one sample: the measured outputs and the answer of the target."""
        self._record.add(
            (time_s, result.command_v, *(float(outputs[name]) for name in self._outputs))
        )
        lost, self._last = result.number - self._last - 1, result.number
        self._estimates.add(
            (
                time_s,
                reference_m,
                *(getattr(result, name) for name in self._answer),
                counters.asked_again,
                counters.bad_frames + result.bad_frames,
                result.trips,
                restarts,
                *(() if self._cycles is None else (lost, self._cycles.overrun[result.number])),
                *(result.theta if isinstance(result, Result) else ()),
            )
        )
        self.samples += 1
