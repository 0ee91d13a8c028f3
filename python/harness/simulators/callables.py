# SPDX-License-Identifier: MIT
"""A rig around a class, an object or a function of Python that a program passes, without a file."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..records import Record
from ..rigs import Rig
from ..rigs.simulator_section import (
    COMMAND,
    OUTPUTS,
    PORTS,
    Signal,
    SimulatorSection,
    SimulatorValue,
    full_name,
)
from .steppers import SimulatorError

# Of a value of which nobody says how well it is known: of its logarithm where it is positive.
USUAL_SIGMA = 0.2
# Commands of servo valves end here; a record with larger ones says more itself.
USUAL_RATED_V = 10.0


def with_function(rig: Rig, function: Callable[..., Any]) -> Rig:
    """Returns the rig with this program in place of the one that its file names."""
    if rig.simulator is None:
        raise ValueError(
            f'{rig.name}: a rig for simulator=... needs plant = "simulator", it has "{rig.plant}"'
        )
    section = replace(rig.simulator, fmu=None, python=None, function=function)
    return replace(rig, simulator=section)


def rig_around(function: Callable[..., Any], records: Sequence[Record]) -> Rig:
    """Returns a rig for a program that tells its names itself.

    Names of inputs and outputs are those of the contract. `inputs`, `outputs` and `parameters` are
    attributes, as far as the program has them; else the command and those of the arguments that are
    ports, the position, and none.

    Raises
    ------
    SimulatorError
        `parameters` does not map names to finite numbers.
    """
    what = str(getattr(function, "__name__", type(function).__name__))
    told = _texts(getattr(function, "inputs", None)) or _arguments(function)
    shown = _texts(getattr(function, "outputs", None)) or ("position_m",)
    values = _values(what, getattr(function, "parameters", {}))
    largest = max(
        (
            float(np.abs(record.column(COMMAND)).max())
            for record in records
            if COMMAND in record.columns
        ),
        default=0.0,
    )
    section = SimulatorSection(
        function=function,
        inputs={COMMAND: Signal(COMMAND)},
        outputs={name: Signal(name) for name in OUTPUTS if name in shown},
        ports={name: Signal(name) for name in PORTS if name in told},
        start={"position_m": Signal("position_m")},
        parameters=values,
    )
    rated = {"valve.rated_command_v": max(USUAL_RATED_V, largest)}
    own = {str(full_name(name)): value.value for name, value in values.items()}
    return Rig(what, "simulator", {**rated, **own}, simulator=section)


def _texts(given: object) -> tuple[str, ...]:
    return tuple(map(str, given)) if isinstance(given, list | tuple) else ()


def _arguments(function: Callable[..., Any]) -> tuple[str, ...]:
    """Arguments of the function, or of its method `step`."""
    try:
        return tuple(inspect.signature(getattr(function, "step", function)).parameters)
    except (TypeError, ValueError):
        return ()


def _values(what: str, given: object) -> dict[str, SimulatorValue]:
    if not isinstance(given, Mapping):
        raise SimulatorError(what, "its 'parameters' are no mapping of names to numbers")
    values = {}
    for name, value in given.items():
        if not isinstance(value, int | float) or not np.isfinite(value):
            raise SimulatorError(
                what, f"parameters['{name}'] = {value!r}: expected a finite number"
            )
        positive = value > 0.0
        sigma = USUAL_SIGMA if positive else max(USUAL_SIGMA * abs(value), 1e-12)
        values[str(name)] = SimulatorValue(float(value), sigma, log=positive)
    return values
