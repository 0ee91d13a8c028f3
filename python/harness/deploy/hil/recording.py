# SPDX-License-Identifier: MIT
"""Record and estimates of a run, written while it goes on.

Each sample is one write of one whole line, so whatever ends the program, the files end with the
sample before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO, Self

from ehsid.harness.deploy.hil.answers import Result
from ehsid.harness.deploy.hil.session import Counters
from ehsid.harness.identification import ArxOrders

RECORD = "record.csv"
ESTIMATES = "estimates.csv"

ESTIMATE_COLUMNS = (
    "time_s",
    "reference_m",
    "gain_v_m",
    "velocity_gain_m_s_v",
    "status",
    "converged",
    "gain_estimated",
    "limited",
    "resets",
    "innovation_m",
    "forgetting_factor",
    "fit_percent",
    "excitation",
    "residual_variance_m2",
    "step_cycles",
    "asked_again",
    "bad_frames",
    "trips",
    "restarts",
)


class Table:
    """A CSV file that grows by whole lines."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        # Unbuffered: a line is with the operating system as soon as write() is back.
        self._file: BinaryIO = path.open("wb", buffering=0)
        self._write(columns)

    def add(self, numbers: Sequence[float | int]) -> None:
        """One row, numbers so that reading gives the same float64."""
        self._write([repr(x) if isinstance(x, float) else str(int(x)) for x in numbers])

    def close(self) -> None:
        """No more rows."""
        self._file.close()

    def _write(self, cells: Sequence[str]) -> None:
        self._file.write((",".join(cells) + "\n").encode("ascii"))


class Recording:
    """The two files of a run, record.csv and estimates.csv, from its first sample on.

    The record holds what the target was sent and what it answered, as float32 numbers: a replay
    gives the bits of the target. A run without a sample leaves no files.

    Attributes
    ----------
    samples
        written so far.
    """

    def __init__(self, folder: Path, outputs: Sequence[str], orders: ArxOrders) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.samples = 0
        self._folder = folder
        self._outputs = tuple(outputs)
        self._record = Table(folder / RECORD, ("time_s", "command_v", *self._outputs))
        try:
            self._estimates = Table(folder / ESTIMATES, (*ESTIMATE_COLUMNS, *orders.names))
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

    def add(
        self,
        time_s: float,
        outputs: Mapping[str, float],
        reference_m: float,
        result: Result,
        counters: Counters,
        restarts: int,
    ) -> None:
        """One sample: what was measured, and the target's answer to it."""
        self._record.add(
            (time_s, result.command_v, *(float(outputs[name]) for name in self._outputs))
        )
        self._estimates.add(
            (
                time_s,
                reference_m,
                result.gain_v_m,
                result.velocity_gain_m_s_v,
                int(result.status),
                result.converged,
                result.gain_estimated,
                result.limited,
                result.resets,
                result.innovation_m,
                result.forgetting_factor,
                result.fit_percent,
                result.excitation,
                result.residual_variance_m2,
                result.step_cycles,
                counters.asked_again,
                counters.bad_frames + result.bad_frames,
                result.trips,
                restarts,
                *result.theta,
            )
        )
        self.samples += 1
