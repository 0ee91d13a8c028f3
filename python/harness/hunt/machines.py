# SPDX-License-Identifier: MIT
"""Machines that experiments run on: a simulator, a program, a board or a rig, behind one interface.

A machine is stepped: `read` gives the outputs now, `step` holds a command for a sampling time. What
is more, the loop that holds the rod and the guard of the limits, is the same for all of them, in
`running`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..catalogue.channels import CHAMBER_PRESSURES, CHANNELS, POSITION, SUPPLY_PRESSURE
from ..rigs import Rig, read_rig
from ..rigs.simulator_section import COMMAND, OUTPUTS, Signal, SimulatorSection
from ..signals.simulation import draw_noise
from ..signals.simulation.run import OUTPUTS as PLANT_OUTPUTS
from ..signals.simulation.run import as_measured, prepare
from ..simulators.callables import rig_around
from ..simulators.opening import PythonSteps, SimulatorError, open_simulator
from ..simulators.source import SourceError, read_place, read_source

# What a simulated machine logs.
LOGGED = (POSITION, *CHAMBER_PRESSURES, SUPPLY_PRESSURE)


@runtime_checkable
class Machine(Protocol):
    """A machine at rest, that can be stepped as often as wanted."""

    @property
    def name(self) -> str:
        """Name for messages and pages."""

    def read(self) -> Mapping[str, float]:
        """Returns the outputs now by contract name, SI; the position is one of them."""

    def step(self, command_v: float) -> None:
        """Holds a command, V, for one sampling time."""


class SimulatedMachine:
    """A rig of a plant of ehsid that plays the machine, from rest at mid-stroke.

    Parameters
    ----------
    rig
        the machine as it truly is, with the noise of its sensors.
    outputs
        what it logs, by contract names; outputs that the plant does not have are left out.
    dt_s
        sampling time, s.
    seed
        of the noise.
    """

    def __init__(self, rig: Rig, outputs: Sequence[str], *, dt_s: float, seed: int) -> None:
        self.name = rig.name
        start = prepare(rig, dt_s=dt_s)
        self._plant = start.plant(quantised=False)
        self._rig, self._values = rig, start.values
        self._places = [(name, PLANT_OUTPUTS.index(name)) for name in outputs]
        self._rng = np.random.default_rng(seed)
        self._now = self._measured()

    def read(self) -> Mapping[str, float]:
        """Returns the outputs now, with noise."""
        return self._now

    def step(self, command_v: float) -> None:
        """Holds a command, V, for one sampling time."""
        self._plant.advance(command_v)
        self._now = self._measured()

    def _measured(self) -> dict[str, float]:
        noise = draw_noise(self._rig, 1, self._rng)[0]
        shown = as_measured(np.asarray(self._plant.read()), noise, self._values)
        return {name: float(shown[place]) for name, place in self._places}


class ProgramMachine:
    """A class or an object with `reset` and `step`, as `docs/user_simulator.md` describes them.

    Parameters
    ----------
    rig
        with the program as its simulator.
    dt_s
        sampling time, s.

    Raises
    ------
    SimulatorError
        the program cannot be started, or is not stepped by Python.
    """

    def __init__(self, rig: Rig, *, dt_s: float) -> None:
        assert rig.simulator is not None
        self.name = rig.name
        opened = open_simulator(rig.simulator)
        steps = opened.start({})
        if not isinstance(steps, PythonSteps):
            raise SimulatorError(
                rig.simulator.what,
                "it gets a whole command: expected a class of Python with reset and step, which "
                "can be stopped within a run",
            )
        self._steps, self._dt_s = steps, dt_s
        self._outputs = opened.outputs
        self._ports = [opened.rest.get(name, 0.0) for name in opened.inputs[1:]]
        self._now = dict(zip(self._outputs, steps.read(), strict=True))

    def read(self) -> Mapping[str, float]:
        """Returns the outputs now."""
        return self._now

    def step(self, command_v: float) -> None:
        """Holds a command, V, for one sampling time."""
        shown = self._steps.step(self._dt_s, [command_v, *self._ports])
        self._now = dict(zip(self._outputs, shown, strict=True))


def machine_of(
    source: str | Path | Machine | Callable[..., Any] | object,
    *,
    dt_s: float,
    seed: int,
    outputs: Sequence[str] = LOGGED,
) -> Machine:
    """Returns the machine that a file or an object stands for.

    Parameters
    ----------
    source
        a machine; a rig file, whose plant plays the machine or names a program; FILE.py:NAME or
        MODULE:NAME of a class; or a class or an object with `reset` and `step`.
    dt_s
        sampling time, s.
    seed
        of the noise, where a plant of ehsid plays the machine.
    outputs
        what a plant of ehsid logs.

    Raises
    ------
    ValueError
        the file cannot be read, or is no machine.
    """
    if isinstance(source, Machine):
        return source
    if not isinstance(source, str | Path):
        return ProgramMachine(rig_around(source, []), dt_s=dt_s)  # type: ignore[arg-type]
    place = read_place(str(source))
    if place is None:
        rig = read_rig(Path(source))
        if rig.simulator is not None:
            return ProgramMachine(rig, dt_s=dt_s)
        has = [
            name for name in outputs if name in PLANT_OUTPUTS and rig.plant in CHANNELS[name].plants
        ]
        return SimulatedMachine(rig, has, dt_s=dt_s, seed=seed)
    try:
        written = read_source(Path(place.where), place.name).outputs if place.is_file else None
    except SourceError as error:
        raise SimulatorError(str(source), str(error)) from None
    shown = [name for name in OUTPUTS if name in (written or (POSITION,))]
    section = SimulatorSection(
        python=str(source),
        inputs={COMMAND: Signal(COMMAND)},
        outputs={name: Signal(name) for name in shown},
    )
    return ProgramMachine(Rig(place.name, "simulator", {}, simulator=section), dt_s=dt_s)
