# SPDX-License-Identifier: MIT
"""Runs of the simulator of a rig, side by side, and what they need to know of it.

What no rig file tells is measured with a few short runs: how fast a volt moves the rod, which mass
a force accelerates, and how fast a flow raises the pressure of each chamber.
"""

from __future__ import annotations

import math
import os
import queue
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

import ehsid

from ..base.numbers import FloatArray
from ..catalogue.parameters import plant_parameters
from ..catalogue.spellings import ParameterKey
from ..rigs import Rig
from ..rigs.simulator_section import SimulatorSection, full_name, own_name
from .around import CATCH_RATE_1_S, Around, Told, run_around
from .opening import Opened, SimulatorError, open_simulator
from .process import RUN_S, Failed, SimulatorProcess, pickled

# Effects that act through ports need steps that follow the oil spring, s.
PORT_STEP_S = 5e-4
# Outputs that are kept, for a fit that comes back to the same values.
KEPT_RUNS = 64
# A machine that is busy with other work may need this long for a short run, s.
LEAST_LIMIT_S = 20.0
# The step of the command, and how long it acts, with which the speed per volt is measured.
STEP_SHARES = (0.1, 0.3)
STEP_S = 0.3
# Of the scale of forces and flows: what is small, but not lost in the digits of a simulator.
PROBE_SHARE = 0.02


@dataclass(frozen=True)
class Measured:
    """What short runs at the values of the rig file show of a simulator."""

    gain_v_m: float
    """Of the feedback that catches it, V/m."""
    speed_per_volt: float
    """m/(s V), with the sign that a positive command moves the rod."""
    mass_kg: float
    stiffness_pa_m3: tuple[float, float]


class SimulatorRuns:
    """The simulator of a rig, ready for runs from several threads; closed by `opened_runs`."""

    def __init__(self, rig: Rig, count: int) -> None:
        assert rig.simulator is not None
        self.rig = rig
        self.section = _usable(rig)
        self._names = list(plant_parameters())
        self._own = [own for name in rig.values if (own := own_name(name)) is not None]
        self._idle: queue.LifoQueue[_Runner] = queue.LifoQueue()
        self._runners: list[_Runner]
        if _can_move(self.section):
            self._runners = [SimulatorProcess(self.section) for _ in range(count)]
        else:
            self._runners = [_InProcess(self.section)]
        for runner in self._runners:
            self._idle.put(runner)
        self._kept: OrderedDict[tuple[int, bytes], FloatArray] = OrderedDict()
        self._lock = threading.Lock()
        self.runs = 0
        self.failures: dict[str, int] = {}
        try:
            self.measured = self._measure()
        except BaseException:
            self.close()
            raise

    @property
    def processes(self) -> int:
        """Number of runs that go on side by side."""
        return len(self._runners)

    def limit_runs(self, seconds: float) -> None:
        """Ends runs that take longer, from here on; none is ended before LEAST_LIMIT_S."""
        for runner in self._runners:
            if isinstance(runner, SimulatorProcess):
                runner.limit_s = min(RUN_S.most, max(seconds, LEAST_LIMIT_S))

    def close(self) -> None:
        """Ends all processes."""
        for runner in self._runners:
            runner.close()

    def own_values(self, rig: Rig) -> FloatArray:
        """Returns the simulator's own values of a rig, shape (S,), in the order of runs."""
        return np.array([rig.values[full_name(name)] for name in self._own])

    def outputs(self, told: Told, values: FloatArray) -> FloatArray:
        """Returns the outputs of a run, shape (N, 6); NaN from where the simulator failed on.

        values: shape (P + S,), those of `Rig.plant_values`, then the S values of the simulator.

        Raises
        ------
        SimulatorError
            the user's program is at fault, so that no run can succeed.
        """
        key = (told.number, values.tobytes())
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        outputs = self._run(told, self._around(values, told.dt_s))
        with self._lock:
            self._kept[key] = outputs
            while len(self._kept) > KEPT_RUNS:
                self._kept.popitem(last=False)
        return outputs

    def _run(self, told: Told, around: Around) -> FloatArray:
        runner = self._idle.get()
        try:
            answer = runner.run(told, around)
        finally:
            self._idle.put(runner)
        with self._lock:
            self.runs += 1
            if isinstance(answer, Failed):
                self.failures[answer.message] = self.failures.get(answer.message, 0) + 1
        if isinstance(answer, Failed):
            return np.full((told.command_v.size, len(ehsid.plant_outputs())), np.nan)
        return answer

    def _around(self, values: FloatArray, dt_s: float) -> Around:
        plant_values = values[: len(self._names)]
        own = dict(zip(self._own, values[len(self._names) :].tolist(), strict=True))
        position = None
        if "position_m" in self.section.start:
            position = float(plant_values[self._names.index(ParameterKey.of_initial("position_m"))])
        return Around(
            plant_values,
            own,
            position,
            self.steps(plant_values, dt_s),
            self.measured.gain_v_m,
            self.measured.mass_kg,
            self.measured.stiffness_pa_m3,
            self._valve(own),
        )

    def steps(self, plant_values: FloatArray, dt_s: float) -> int:
        """Communication steps in a sample, with the effects that act in a run."""
        steps = math.ceil(dt_s / (self.section.step_s or dt_s) - 1e-9)
        if _acts_at_ports(self._names, plant_values):
            steps = max(steps, math.ceil(dt_s / PORT_STEP_S - 1e-9))
        return max(1, steps)

    def _valve(self, own: Mapping[str, float]) -> tuple[float, float]:
        bandwidth, damping = self.section.valve_bandwidth, self.section.valve_damping
        if bandwidth is None:
            return 0.0, 0.0
        told = own.get(damping, USUAL_DAMPING) if isinstance(damping, str) else damping
        return own[bandwidth], USUAL_DAMPING if told is None else told

    def _measure(self) -> Measured:
        dt_s = min(self.section.step_s or 1e-3, 1e-3)
        rest = self._short(dt_s, STEP_S, 0.0, {})
        rated = self.rig.values["valve.rated_command_v"]
        speed = 0.0
        for share in STEP_SHARES:
            moved = self._short(dt_s, STEP_S, share * rated, {})[:, 0] - rest[:, 0]
            tail = moved[2 * moved.size // 3 :]
            speed = float(np.polyfit(np.arange(tail.size) * dt_s, tail, 1)[0]) / (share * rated)
            if math.isfinite(speed) and abs(speed) > 1e-9:
                break
        else:
            raise SimulatorError(
                self.section.what,
                f"a command of {STEP_SHARES[-1] * rated:g} V does not move the position within "
                f"{STEP_S:g} s: expected a simulator of a servo; check [simulator.inputs] and "
                "[simulator.outputs]",
            )
        return Measured(
            CATCH_RATE_1_S / speed,
            speed,
            self._mass(dt_s, rest),
            (self._stiffness(dt_s, rest, "a"), self._stiffness(dt_s, rest, "b")),
        )

    def _mass(self, dt_s: float, rest: FloatArray) -> float:
        """Mass from the speed after a step in which a force acts: m = F h / v, kg."""
        if "force_n" not in self.section.ports:
            return 0.0
        force = PROBE_SHARE * self.section.scales.get("force_n", 1e4)
        pushed = self._short(dt_s, 3 * dt_s, 0.0, {"effects.load_force.force_n": -force})
        speed = float(pushed[1, 1] - rest[1, 1])
        if not speed * force > 0.0:
            raise SimulatorError(
                self.section.what,
                "a force that extends the rod does not move it: check 'positive' of "
                "[simulator.ports] force_n",
            )
        return force * dt_s / speed

    def _stiffness(self, dt_s: float, rest: FloatArray, side: str) -> float:
        """Rise of a chamber's pressure over the volume that a flow brings, Pa/m^3."""
        column = {"a": 2, "b": 3}[side]
        if f"flow_{side}_m3_s" not in self.section.ports or not np.isfinite(rest[0, column]):
            return 0.0
        flow = PROBE_SHARE * self.section.scales.get("flow_m3_s", 1e-3)
        tank = self.rig.values.get("supply.tank_pressure_pa", 1e5)
        coefficient = flow / max(float(rest[0, column]) - tank, 1e5)
        name = f"effects.external_leakage.coefficient_{side}_m3_s_pa"
        leaked = self._short(dt_s, 3 * dt_s, 0.0, {name: coefficient})
        drop = float(rest[1, column] - leaked[1, column])
        if not drop > 0.0:
            raise SimulatorError(
                self.section.what,
                f"a flow out of chamber {side} does not lower its pressure: check "
                f"[simulator.ports] flow_{side}_m3_s, which must go into the chamber",
            )
        return drop / (coefficient * max(float(rest[0, column]) - tank, 1e5) * dt_s)

    def _short(
        self, dt_s: float, seconds: float, command_v: float, effects: Mapping[str, float]
    ) -> FloatArray:
        """Runs a held command from the start, at the values of the rig file."""
        samples = max(3, round(seconds / dt_s))
        told = Told(
            np.full(samples, command_v), np.zeros(samples), np.zeros(samples, np.uint8), dt_s
        )
        values = self.rig.plant_values(effects)
        own = dict(zip(self._own, self.own_values(self.rig).tolist(), strict=True))
        runner = self._idle.get()
        try:
            answer = runner.run(told, Around(values, own, None))
        finally:
            self._idle.put(runner)
        if isinstance(answer, Failed):
            raise SimulatorError(self.section.what, answer.message)
        if not np.isfinite(answer[:, 0]).all():
            raise SimulatorError(
                self.section.what,
                f"its position is no number within the first {seconds:g} s at the values of the "
                "rig file",
            )
        return answer


# Of a servo valve whose damping is not told.
USUAL_DAMPING = 0.9


class _InProcess:
    """A program that no other process can have, which runs here, one run at a time."""

    def __init__(self, section: SimulatorSection) -> None:
        self._section = section
        self._opened: Opened | None = None

    def run(self, told: Told, around: Around) -> FloatArray | Failed:
        if self._opened is None:
            self._opened = open_simulator(self._section)
        return run_around(self._opened, told, around)

    def close(self) -> None:
        if self._opened is not None:
            self._opened.close()


_Runner = SimulatorProcess | _InProcess


def _can_move(section: SimulatorSection) -> bool:
    """Whether another process can have the program."""
    if section.function is None:
        return True
    try:
        pickled(section)
    except Exception:  # a lock, a socket, an object of C: pickle has no common error
        return False
    return True


def _usable(rig: Rig) -> SimulatorSection:
    """The section without a port for the supply where no supply pressure is told to give it."""
    section = rig.simulator
    assert section is not None
    if "supply.pressure_pa" in rig.values or "supply_pressure_pa" not in section.ports:
        return section
    ports = {name: port for name, port in section.ports.items() if name != "supply_pressure_pa"}
    return replace(section, ports=ports)


def _acts_at_ports(names: list[str], values: FloatArray) -> bool:
    return any(
        value != 0.0 and ParameterKey(name).effect in AT_PORTS
        for name, value in zip(names, values.tolist(), strict=True)
    )


# Effects that act through inputs for force, flows or the supply.
AT_PORTS = frozenset(
    info.id for info in ehsid.effects() if info.subsystem in ("mechanics", "hydraulics")
)


@contextmanager
def opened_runs(rig: Rig) -> Iterator[SimulatorRuns]:
    """Opens the simulator of a rig, as often as there are cores, and closes it at the end."""
    runs = SimulatorRuns(rig, os.cpu_count() or 1)
    try:
        yield runs
    finally:
        runs.close()
