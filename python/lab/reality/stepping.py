# SPDX-License-Identifier: MIT
"""A blind machine that is stepped from outside, as a test rig with its sensors is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from . import machine as equations
from .case import COLUMNS, Sensors, start_state
from .machine import begun, run_samples
from .noise import Logger, draw_noise
from .nominal_rig import NominalRig
from .truth import Truth

# Factor by which the integration steps of an oscillation are shortened.
REFINEMENT = 2
OUTPUTS = {
    "position_m": equations.OUT_Y,
    "pressure_a_pa": equations.OUT_P_A,
    "pressure_b_pa": equations.OUT_P_B,
    "supply_pressure_pa": equations.OUT_P_S,
}


class SteppedReality:
    """A machine of the generator, from rest at a position.

    Parameters
    ----------
    name
        for messages.
    machine
        constants of the machine; faults of its pressure transducers are left out.
    rig
        values in its rig file.
    logger
        that takes its samples.
    sensors
        what is logged.
    dt_s
        sampling time, s.
    seconds
        longest time in which it can be stepped.
    seed
        of the noise.
    position_m
        of the rod at the begin.
    """

    def __init__(
        self,
        name: str,
        machine: Truth,
        rig: NominalRig,
        logger: Logger,
        *,
        sensors: Sensors,
        dt_s: float,
        seconds: float,
        seed: int,
        position_m: float,
    ) -> None:
        self.name = name
        samples = round(seconds / dt_s)
        self._dt_s = dt_s
        self._rated = rig.values.get("valve.rated_command_v", 10.0)
        noise = self._noise = draw_noise(np.random.default_rng(seed), rig, samples, logger)
        self._truth = machine._replace(
            sensor_step_m=max(machine.sensor_step_m, noise.position_step_m)
        )
        self._shown = [one for one in OUTPUTS if one == "position_m" or one in COLUMNS[sensors]]
        self._run = begun(self._truth, start_state(self._truth, position_m), samples)
        self._forward = np.zeros(samples)
        self._lost = np.zeros(samples, dtype=np.bool_)
        self._k = 0
        self._look()

    @property
    def true_outputs(self) -> Mapping[str, float]:
        """Position, speed and pressures now, as no sensor shows them, SI."""
        s = self._run.state
        row = self._run.out[self._k]
        pressures = {name: float(row[OUTPUTS[name]]) for name in OUTPUTS if name != "position_m"}
        return {
            "position_m": float(s[equations.Y]),
            "speed_m_s": float(s[equations.V]),
            **pressures,
        }

    def read(self) -> Mapping[str, float]:
        """Returns the sample now, as the sensors show it."""
        row, k, noise = self._run.out[self._k], self._k, self._noise
        shown = {name: float(row[OUTPUTS[name]]) for name in self._shown}
        for name in self._shown:
            if name in noise.pressures_pa:
                noisy = shown[name] + noise.pressures_pa[name][k]
                shown[name] = noise.pressure_step_pa * round(noisy / noise.pressure_step_pa)
        return shown

    def step(self, command_v: float) -> None:
        """Holds a command, V, for one sampling time."""
        self._forward[self._k] = command_v / self._rated
        self._advance()
        self._k += 1
        self._look()

    def _look(self) -> None:
        """Takes the sample now. The machine goes on only when it has its command."""
        run = self._run
        kept = run.state.copy(), run.memory.copy(), run.plays.copy()
        self._advance()
        for array, values in zip((run.state, run.memory, run.plays), kept, strict=True):
            array[:] = values

    def _advance(self) -> None:
        noise = self._noise
        run_samples(
            *(self._k, self._k + 1, self._truth, self._run, self._dt_s, self._forward),
            *(self._forward, 0.0, noise.command_step, noise.position_m, noise.late_s),
            *(self._lost, REFINEMENT),
        )
