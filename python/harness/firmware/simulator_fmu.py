# SPDX-License-Identifier: MIT
"""The simulator of a rig file as an FMU: its values and its effects are parameters.

The sources are the headers of the simulator and a wrapper around it, so that a run of the FMU has
the bits of a run in Python.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import ehsid

from ..base.error_words import printable
from ..catalogue.channels import CHANNELS, COMMAND
from ..catalogue.parameters import parameter_keys, plain_name, plant_parameters
from ..catalogue.spellings import ParameterKey
from ..records.units import base_exponents
from ..rigs import Rig
from ..rigs.checks import may_be_off
from ..rigs.rig import VARIABLES, table_words
from ..signals.simulation.run import (
    MOST_SUBSTEPS,
    OUTPUTS,
    OUTPUTS_OF,
    QUANTISATION,
    REFINEMENT,
    prepare,
)
from .fmi_functions import of_simulator
from .fmu import Model, Variable, held_in_words, write_fmu
from .header import check_name
from .plant_header import plant_header

WRAPPER = "simulator_fmu.cpp"
# Values of tables have no bounds but those of numbers.
_LARGEST = sys.float_info.max
# SI units of what a table adds to an equation.
_OF_TERM = MappingProxyType(
    {
        "spool": "1",
        "flow_a": "m^3/s",
        "flow_b": "m^3/s",
        "force": "N",
        "sensor": "m",
        "delay": "s",
        "mass": "kg",
    }
)


class _Parameter(NamedTuple):
    """A parameter, its place among the values of the plant, and its plausible range."""

    name: str
    place: int
    start: float
    unit: str
    description: str
    least: float = -_LARGEST
    most: float = _LARGEST
    off: bool = True
    """Whether it may be zero, whatever its range."""

    @property
    def allows(self) -> tuple[bool, bool]:
        """Whether it has a meaning below zero, and at zero; a fit may leave the plausible range."""
        return self.least < 0.0, self.least <= 0.0 or self.off

    def variable(self) -> Variable:
        """Returns the variable of the FMU."""
        low, high = (min(self.least, 0.0), max(self.most, 0.0)) if self.off else self[5:7]
        bounded = high < _LARGEST
        return Variable(
            self.name,
            "parameter",
            self.description,
            start=self.start,
            variability="fixed",
            unit=self.unit,
            least=low if bounded else None,
            most=high if bounded else None,
        )


def _of_catalogue(rig: Rig, start: Sequence[float]) -> list[_Parameter]:
    """Returns the values of the rig file, all parameters of its effects, and where a run starts.

    A pressure at the start is NaN where it is that of balance, which no parameter can say.
    """
    in_file = {ParameterKey(name).effect for name in rig.values} - {None}
    made = []
    for place, (key, value) in enumerate(zip(parameter_keys(), start, strict=True)):
        if key in rig.values or key.effect in in_file or (key.is_initial and not math.isnan(value)):
            info = plant_parameters()[key]
            words = ": ".join(text for text in (_called(key, info), info.meaning) if text)
            bounds = (info.minimum, info.maximum, may_be_off(key))
            made.append(_Parameter(key, place, value, info.unit, words, *bounds))
    return made


def _called(key: ParameterKey, info: ehsid.PlantParameter) -> str:
    return info.called if key.effect is None else plain_name(key.effect)


def _of_tables(rig: Rig, first: int) -> list[_Parameter]:
    """Returns the values of the tables, which stand from the place `first` on."""
    made: list[_Parameter] = []
    for name, law in rig.tables.items():
        # Names are those of a language; another name stands in quotation marks (FMI 2.0, 2.2.9).
        shown = name if re.fullmatch(r"[A-Za-z_]\w*", name) else f"'{name}'"
        words = table_words(law.adds_to, law.of)
        for i, (knot, value) in enumerate(zip(law.knots, law.values, strict=True), 1):
            full, place = f"effects.table.{shown}.values[{i}]", first + len(made)
            unit = _OF_TERM[law.adds_to]
            made.append(_Parameter(full, place, value, unit, f"{words}, at {knot:g} in SI units"))
    return made


def _signals(rig: Rig) -> list[Variable]:
    """Returns command and outputs."""
    command = CHANNELS[COMMAND]
    outputs = [CHANNELS[name] for name in OUTPUTS_OF[rig.plant]]
    return [
        Variable(COMMAND, "input", command.meaning, start=0.0, unit=command.unit),
        *(
            Variable(one.name, "output", one.meaning, variability="continuous", unit=one.unit)
            for one in outputs
        ),
    ]


@dataclass(frozen=True)
class SimulatorFmu:
    """The files of the FMU of a simulator."""

    rig: Rig
    name: str
    fmi: int
    dt_s: float
    files: dict[str, str]
    """Text files by their place in the archive."""
    parameters: int
    """Number of parameters."""

    def write(self, path: Path) -> str:
        """Writes the archive, and returns what it holds, in words."""
        held = held_in_words(write_fmu(path, self.files, name=self.name, fmi=self.fmi), self.fmi)
        on = [plain_name(effect) for effect in self.rig.effects()] + [
            f"table {name}" for name in self.rig.tables
        ]
        return (
            f"simulator of {printable(self.rig.name)} in steps of {self.dt_s:g} s, "
            f"{self.parameters} parameters, effects: {', '.join(on) or 'none'}; {held}"
        )


def simulator_fmu(rig: Rig, *, name: str, fmi: int = 2, dt_s: float = 1e-3) -> SimulatorFmu:
    """Makes the FMU of a rig with a plant of ehsid.

    Parameters
    ----------
    rig
        the machine with its effects and tables.
    name
        identifier of the model.
    fmi
        version, 2 or 3.
    dt_s
        time from one command to the next, s; a step of the FMU is that, or a whole multiple.

    Raises
    ------
    ValueError
        the plant is a simulator of the user, or a value or the time cannot be simulated.
    """
    check_name(name)
    if rig.simulator is not None:
        raise ValueError(
            f"{rig.name}: its plant is a simulator of the user, whose equations ehsid does not "
            "have: expected a rig of a plant of ehsid; export the simulator with its own tool, or "
            "choose another rig file"
        )
    start = prepare(rig, dt_s=dt_s).plant_values.tolist()
    tables = rig.table_values().tolist()
    signals = _signals(rig)
    parameters = _of_catalogue(rig, start) + _of_tables(rig, len(start))
    variables = [*signals, *(one.variable() for one in parameters)]
    units = dict.fromkeys(one.unit for one in variables)
    model = Model(
        name=name,
        title=printable(rig.name),
        description=f"Simulator of a servo, plant {rig.plant}",
        variables=variables,
        language="C++17",
        sources={"plant.hpp": plant_header(f"{name}_plant")},
        dt_s=dt_s,
        serialised=False,
        units={unit: base_exponents(unit) for unit in units},
    )
    quantised = QUANTISATION in rig.values
    values = {
        "plant": rig.plant,
        "refinement": REFINEMENT,
        "most_substeps": MOST_SUBSTEPS,
        "output_places": [OUTPUTS.index(one.name) for one in signals[1:]],
        "parameters": parameters,
        "values": [*start, *tables],
        "plant_count": len(start),
        "tables": list(rig.tables.values()),
        "table_variables": VARIABLES,
        "quantisation": parameter_keys().index(QUANTISATION) if quantised else None,
        "linkage": 'extern "C" ',
        "number_type": "double",
        "real_kind": "Float64",
    }
    files = model.files(fmi, WRAPPER, of_simulator(fmi), values)
    return SimulatorFmu(rig, name, fmi, dt_s, files, len(parameters))
