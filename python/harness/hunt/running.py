# SPDX-License-Identifier: MIT
"""Runs an experiment on a machine within limits that are looked at before each command.

A servo drifts. A slow loop therefore holds the rod about the path that the experiment is expected
to take, as it did when the experiment was designed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.numbers import FloatArray
from ..catalogue.channels import COMMAND, POSITION
from ..diagnosis.data.gate import gate
from ..diagnosis.limits import Limits
from ..diagnosis.next_experiment import DESIGN_HELD_HZ
from ..records import Record, make_record
from ..rigs import Rig
from ..signals.simulation import PositionController, suggested_controller
from .guard import Guard, Seen
from .machines import Machine

# Longest time in which the rod is brought to where an experiment begins, s, and how near it comes,
# as a share of the travel.
APPROACH_S, NEAR = 10.0, 0.005
# The rod is held after an approach and after an experiment, s, so that the next one begins at rest.
HELD_S = 0.5
# Share of the command limit with which the rod is brought and held.
GENTLE = 0.2
# A shorter record tells little, s.
LEAST_S = 3.0
# Largest bandwidth of the loop that brings the rod, Hz.
APPROACH_HZ = 1.0


@dataclass(frozen=True, eq=False)
class Experiment:
    """A command with the path that the simulator expects, N samples."""

    description: str
    command_v: FloatArray
    path_m: FloatArray
    """(N,): command, V, and the position that it is expected to give, m."""
    dt_s: float


@dataclass(frozen=True, eq=False)
class Ran:
    """What came of an experiment."""

    record: Record | None
    """The samples until the end, or until the guard ended it; None where they cannot be used."""
    stopped: str
    """Why the guard ended it, or why its record cannot be used; "" where it went to its end."""
    seen: Seen
    """How far the machine went, from the approach to the rest behind it."""
    seconds: float
    """Duration until its end, s."""


def run_experiment(
    machine: Machine, experiment: Experiment, rig: Rig, limits: Limits, name: str
) -> Ran:
    """Brings the rod to the begin of the path, runs the experiment, and holds the rod at its end.

    The command is that of the experiment, plus a slow loop that holds the rod about the path.

    Parameters
    ----------
    machine
        the machine, with the sampling time of the experiment.
    experiment
        what to run.
    rig
        the machine as its rig file tells it, for the gains of the loops.
    limits
        what may not be passed; looked at before each command.
    name
        of the record.
    """
    guard = Guard(limits, experiment.dt_s)
    slow = suggested_controller(rig, DESIGN_HELD_HZ)
    hold = _Hold(machine, guard, suggested_controller(rig, _approach_hz(rig)), limits)
    hold.bring(float(experiment.path_m[0]), experiment.dt_s)
    commands: list[float] = []
    samples: list[Mapping[str, float]] = []
    stopped = ""
    for wished, expected in zip(experiment.command_v, experiment.path_m, strict=True):
        sample = machine.read()
        stopped = guard.reason(sample)
        if stopped:
            break
        back = slow.gain_v_m * (float(expected) - sample[POSITION])
        command = guard.command(float(wished) + back)
        commands.append(command)
        samples.append(sample)
        machine.step(command)
    low, high = limits.position_m
    hold.stay(min(max(machine.read()[POSITION], low), high), experiment.dt_s)
    record = _record(commands, samples, experiment.dt_s, name)
    if record is not None and not stopped:
        stopped = next((each.what for each in gate([record], rig) if each.serious), "")
        record = None if stopped else record
    return Ran(record, stopped, guard.seen, experiment.dt_s * len(commands))


def _approach_hz(rig: Rig) -> float:
    """Bandwidth of the loop that brings the rod, Hz: that which the rig bears."""
    usual, per_hz = (suggested_controller(rig, hz).gain_v_m for hz in (None, 1.0))
    return max(DESIGN_HELD_HZ, min(APPROACH_HZ, usual / per_hz))


@dataclass(frozen=True, eq=False)
class _Hold:
    """Brings the rod to a position and holds it there, gently."""

    machine: Machine
    guard: Guard
    controller: PositionController
    limits: Limits

    def bring(self, to_m: float, dt_s: float) -> None:
        """Goes on until the rod is near; a dead band may keep it from coming nearer."""
        for _ in range(round(APPROACH_S / dt_s)):
            reason = self._step(to_m)
            near = abs(to_m - self.machine.read()[POSITION]) < NEAR * self.limits.span_m
            if near or reason:
                break
        self.stay(to_m, dt_s)
        at_rest = self.stay(to_m, dt_s)
        # Of two samples the difference has twice the variance of one.
        self.guard.noise_m = float(np.std(np.diff(at_rest))) / math.sqrt(2.0)

    def stay(self, at_m: float, dt_s: float) -> list[float]:
        """Holds the rod for HELD_S; returns the positions."""
        positions = []
        for _ in range(max(3, round(HELD_S / dt_s))):
            positions.append(self.machine.read()[POSITION])
            self._step(at_m)
        return positions

    def _step(self, to_m: float) -> str:
        """One sample; returns what the guard says of it."""
        sample = self.machine.read()
        reason = self.guard.reason(sample)
        most = GENTLE * self.limits.command_v
        wished = self.controller.gain_v_m * (to_m - sample[POSITION])
        self.machine.step(self.guard.command(min(max(wished, -most), most)))
        return reason


def _record(
    commands: list[float], samples: list[Mapping[str, float]], dt_s: float, name: str
) -> Record | None:
    """Returns the record of so many samples; None of fewer than LEAST_S."""
    if len(commands) < LEAST_S / dt_s:
        return None
    measured = {key: np.array([one[key] for one in samples]) for key in samples[0]}
    time_s = dt_s * np.arange(len(commands))
    return make_record({"time_s": time_s, COMMAND: np.array(commands), **measured}, name=name)
