# SPDX-License-Identifier: MIT
"""What the user wishes during a run, as it comes through the pipe from the page."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path

from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.hil.errors import HilError
from ehsid.hil.faults import OnRequest
from ehsid.hil.snapshot import ENDING, read_snapshot, restored, write_snapshot
from ehsid.hil.steering import Stopped

from .told import Told, write_told
from .watching import Watch
from .words import FAULTS

SNAPSHOTS = "snapshots"


class Wishes:
    """Carries out wishes between two samples; see `Steer`.

    A wish that cannot be carried out is told among the events, and the run goes on.
    """

    def __init__(
        self,
        folder: Path,
        control: Connection,
        told: Told,
        watch: Watch,
        start: EstimatorConfiguration,
        faults: OnRequest | None,
        reset_board: Callable[[], None] | None,
    ) -> None:
        self._folder, self._control, self._told = folder, control, told
        self._watch, self._start = watch, start
        self._faults, self._reset_board = faults, reset_board

    def __call__(self, number: int) -> EstimatorConfiguration | None:
        """Carries out what has come before a sample."""
        del number
        wish = None
        while self._control.poll():
            kind, *values = self._control.recv()
            try:
                wish = self._carry_out(kind, values) or wish
            except (ValueError, OSError) as error:
                self._tell(str(error))
        if wish is not None:
            self._watch.begin(wish)
        return wish

    def _tell(self, words: str) -> None:
        self._told.event(self._watch.time_s, words)
        write_told(self._folder, self._told)

    def _carry_out(self, kind: str, values: list[str]) -> EstimatorConfiguration | None:
        match kind, values:
            case "stop", []:
                raise Stopped
            case "reset", []:
                self._tell("The estimator begins anew.")
                return self._start
            case "snapshot", []:
                self._store()
            case "restore", [name]:
                wish = restored(read_snapshot(self._folder / SNAPSHOTS / name), self._start)
                self._tell(f"The estimator goes on from {name}.")
                return wish
            case "fault", [fault, direction] if self._faults is not None:
                self._faults.ask(fault, direction)
                self._tell(f"Fault: {FAULTS[fault]}, on the way {direction}.")
            case "reset board", [] if self._reset_board is not None:
                self._reset_board()
                self._tell("The board was reset.")
        return None

    def _store(self) -> None:
        if self._watch.samples == 0:
            raise HilError("no snapshot: there is no sample yet; wait for the first one")
        folder = self._folder / SNAPSHOTS
        folder.mkdir(exist_ok=True)
        name = f"{len(self._told.snapshots) + 1}_at_{self._watch.time_s:.2f}_s{ENDING}"
        write_snapshot(folder / name, self._watch.snapshot())
        self._told.snapshots = [*self._told.snapshots, name]
        self._tell(f"The estimate is stored as snapshots/{name}.")
