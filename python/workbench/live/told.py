# SPDX-License-Identifier: MIT
"""What a run tells its pages: a small file that is replaced at every event, and a ring of samples.

Pages read both files; they need not have been there when the run began.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import write_text

FILE = "told.json"
RING = "samples.npy"
MOST_EVENTS = 30

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
)


class Told(msgspec.Struct):
    """Content of the file.

    Attributes
    ----------
    phase
        what the worker does, in words.
    board, firmware
        the target, as it answers.
    rig
        name of the rig.
    parameters
        names of the parameters.
    samples, dt_s
        number of samples of the plan, and the sampling time, s.
    position_control
        whether the target controls the position.
    faults
        whether faults can be put into the line; `board_reset`: whether the board can be reset.
    events
        what has happened, the newest last: time in the run, s, and words.
    snapshots
        names of the files below snapshots/.
    """

    phase: str = ""
    board: str = ""
    firmware: str = ""
    rig: str = ""
    parameters: list[str] = msgspec.field(default_factory=list)
    samples: int = 0
    dt_s: float = 0.0
    position_control: bool = False
    faults: bool = False
    board_reset: bool = False
    events: list[tuple[float, str]] = msgspec.field(default_factory=list)
    snapshots: list[str] = msgspec.field(default_factory=list)

    def event(self, time_s: float, words: str) -> None:
        """Adds an event; the oldest one goes where there are too many."""
        words = words[:1].upper() + words[1:]
        self.events = [*self.events, (time_s, words)][-MOST_EVENTS:]


def write_told(folder: Path, told: Told) -> None:
    """Writes the file, whole or not at all."""
    write_text(folder / FILE, json_text(told))


def read_told(folder: Path) -> Told:
    """Reads the file; what a run tells that has not begun is empty."""
    return read_json(folder / FILE, Told) or Told()
