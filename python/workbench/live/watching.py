# SPDX-License-Identifier: MIT
"""Watches a run sample by sample: what the page draws, and the estimator of this host beside it.

What a run tells its pages: a small file that is replaced at every event, and a ring of samples.

Pages read both files; they need not have been there when the run began.

The newest samples of a run in a file of fixed size: one process writes, any number reads.

The first row holds the number of samples that were written so far. A sample is written before the
number counts it. Readers use the newer half of the rows only, so that the writer does not overtake
them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.hil.answers import Result, SampleAnswer
from ehsid.hil.configuration import Snapshot, taken
from ehsid.hil.plan import Plan
from ehsid.hil.recording import Recording
from ehsid.hil.session import Counters
from ehsid.hil.transport import Line

FILE = "status.json"
RING = "samples.npy"
MOST_EVENTS = 30

# What each fault does to the next frame; `hold` is told with its time.
FAULTS = {
    "drop": "Lose a frame",
    "flip": "Damage a bit",
    "cut": "Cut a frame short",
    "unended": "Join two frames",
    "repeat": "Repeat a frame",
    "noise": "Insert noise",
    "hold": "Delay by 1 s",
}

# Columns of the ring in front of the parameters and their standard deviations.
COLUMNS = (
    "time_s",
    "wall_s",
    "command_v",
    "position_m",
    "reference_m",
    "innovation_m",
    "forgetting_factor",
    "fit_percent",
    "gain_v_m",
    "status",
    "converged",
    "limited",
    "changes",
    "sent",
    "asked_again",
    "late",
    "bad_here",
    "bad_there",
    "resumed",
    "restarts",
    "agrees",
    # K, omega_n and xi of the servo, each with the half width of its 90 % interval.
    "velocity_gain",
    "velocity_gain_half",
    "omega_n",
    "omega_n_half",
    "xi",
    "xi_half",
)


class RunStatus(msgspec.Struct):
    """Content of the file."""

    phase: str = ""
    """What the worker does, in words."""
    board: str = ""
    firmware: str = ""
    """The target, as it answers."""
    rig: str = ""
    """Name of the rig."""
    parameters: list[str] = msgspec.field(default_factory=list)
    """Names of the parameters."""
    samples: int = 0
    dt_s: float = 0.0
    """Number of samples of the plan, and the sampling time, s."""
    position_control: bool = False
    """Whether the target controls the position."""
    faults: bool = False
    """Whether faults can be put into the line; `board_reset`: whether the board can be reset."""
    board_reset: bool = False
    machine: dict[str, float] = msgspec.field(default_factory=dict)
    """Values of the simulated machine in place of those of its rig, by full name."""
    events: list[tuple[float, str]] = msgspec.field(default_factory=list)
    """What has happened, the newest last: time in the run, s, and words."""
    snapshots: list[str] = msgspec.field(default_factory=list)
    """Names of the files below snapshots/."""

    def event(self, time_s: float, words: str) -> None:
        """Adds an event; the oldest one goes where there are too many."""
        words = words[:1].upper() + words[1:]
        self.events = [*self.events, (time_s, words)][-MOST_EVENTS:]


def write_status(folder: Path, status: RunStatus) -> None:
    """Writes the file, whole or not at all."""
    write_text(folder / FILE, json_text(status))


def read_status(folder: Path) -> RunStatus:
    """Reads the file; what a run tells that has not begun is empty."""
    return read_json(folder / FILE, RunStatus) or RunStatus()


ROWS = 65536


class RingWriter:
    """Writes samples of a fixed number of columns."""

    def __init__(self, path: Path, columns: int, rows: int = ROWS) -> None:
        shape = (rows + 1, columns)
        # Whole under its name at once: a reader may look between the header and the rows.
        aside = path.with_name(f".{path.name}.part")
        self._file = np.lib.format.open_memmap(aside, mode="w+", dtype=np.float64, shape=shape)
        aside.replace(path)
        self._rows = rows
        self._count = 0

    def add(self, sample: npt.ArrayLike) -> None:
        """Adds a sample in the place of the oldest one."""
        self._file[1 + self._count % self._rows] = sample
        self._count += 1
        self._file[0, 0] = self._count


class RingReader:
    """Reads the newest samples."""

    def __init__(self, path: Path) -> None:
        self._file = np.load(path, mmap_mode="r")

    @property
    def count(self) -> int:
        """Number of samples that were written so far."""
        return int(self._file[0, 0])

    def newest(self, samples: int) -> FloatArray:
        """Returns at most this many of the newest samples, the oldest in front."""
        rows, count = len(self._file) - 1, self.count
        samples = min(samples, count, max(1, rows // 2))
        places = np.arange(count - samples, count) % rows
        return np.asarray(self._file[1 + places])


class Watch(Recording):
    """Records a run, and puts every sample into the ring with the deviations of the parameters.

    The target does not send the deviations. The estimator of this host gives them: it takes the
    same samples, and its numbers are those of the target bit for bit; `agrees` says whether.

    Attributes
    ----------
    time_s
        time of the last sample, s.
    agrees
        whether all parameters of the target so far were those of the host.
    """

    def __init__(
        self, folder: Path, samples: Path, outputs: Sequence[str], plan: Plan, line: Line | None
    ) -> None:
        self._plan = plan.configuration.estimator
        super().__init__(samples, outputs, self._plan.orders)
        self._dt_s = plan.dt_s
        self.time_s = 0.0
        self.agrees = True
        self._rig = plan.rig.name
        self._line = line
        self._began = time.monotonic()
        self._restarts = 0
        self._begin(self._plan)
        self._ring = RingWriter(folder / RING, len(COLUMNS) + 2 * self._plan.orders.n_parameters)
        self._theta: tuple[float, ...] = ()

    def begin(self, configuration: EstimatorConfiguration) -> None:
        """Lets the estimator of the host begin anew, as that of the target does."""
        self._begin(configuration)

    def _begin(self, configuration: EstimatorConfiguration) -> None:
        self._now, self._estimator = configuration, configuration.estimator()
        # Beside that of the target: what a control engineer reads.
        self._servo = ehsid.ServoEstimator(self._dt_s)

    def snapshot(self) -> Snapshot:
        """Returns the present estimate; see `taken`."""
        return taken(
            self._estimator, self._now, self._theta, rig=self._rig, time_s=round(self.time_s, 6)
        )

    def add(
        self,
        time_s: float,
        outputs: Mapping[str, float],
        reference_m: float,
        result: SampleAnswer,
        counters: Counters,
        restarts: int,
    ) -> None:
        """Appends one sample."""
        assert isinstance(result, Result)  # this page runs no ServoEstimator
        super().add(time_s, outputs, reference_m, result, counters, restarts)
        if restarts > self._restarts:  # the target was reset, and began with the plan's settings
            self._restarts = restarts
            self._begin(self._plan)
        self._estimator.step(result.command_v, outputs["position_m"])
        self._servo.step(result.command_v, outputs["position_m"])
        found = self._servo.servo()
        ours = np.asarray(self._estimator.theta_hat, dtype=np.float32)
        self.agrees &= ours.tobytes() == np.asarray(result.theta, dtype=np.float32).tobytes()
        self.time_s, self._theta = time_s, result.theta
        values = {
            "time_s": time_s,
            "wall_s": time.monotonic() - self._began,
            "command_v": result.command_v,
            "position_m": outputs["position_m"],
            "reference_m": reference_m,
            "innovation_m": result.innovation_m,
            "forgetting_factor": result.forgetting_factor,
            "fit_percent": result.fit_percent,
            "gain_v_m": result.gain_v_m,
            "status": result.status,
            "converged": result.converged,
            "limited": result.limited,
            "changes": result.resets,
            "sent": 0 if self._line is None else self._line.sent,
            "asked_again": counters.asked_again,
            "late": counters.late,
            "bad_here": counters.bad_frames,
            "bad_there": result.bad_frames,
            "resumed": counters.resumed,
            "restarts": restarts,
            "agrees": self.agrees,
            "velocity_gain": found.gain.value,
            "velocity_gain_half": found.gain.half_width,
            "omega_n": found.omega_n.value,
            "omega_n_half": found.omega_n.half_width,
            "xi": found.xi.value,
            "xi_half": found.xi.half_width,
        }
        deviation = self._estimator.standard_deviation
        self._ring.add([*(values[name] for name in COLUMNS), *result.theta, *deviation])


def throttled(call: Callable[[float], None], every_s: float) -> Callable[[float], None]:
    """Returns a function that passes a share on at most once in this time."""
    last = 0.0

    def passed(share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= every_s:
            last = now
            call(share)

    return passed
