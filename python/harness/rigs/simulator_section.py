# SPDX-License-Identifier: MIT
"""A user's own simulator in a rig file: which program it is, and what its names mean.

Sections `[simulator]` of a rig with `plant = "simulator"`; `docs/rigs.md` describes each key.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ..catalogue.spellings import ParameterKey

# Begin of the full name of a value of the simulator in `Rig.values`.
PREFIX = "simulator.parameters."

# What a run takes and gives, by contract names. The command is always there.
COMMAND = "command_v"
PORTS = ("force_n", "supply_pressure_pa", "flow_a_m3_s", "flow_b_m3_s")
OUTPUTS = (
    "position_m",
    "velocity_m_s",
    "pressure_a_pa",
    "pressure_b_pa",
    "supply_pressure_pa",
    "supply_flow_m3_s",
)
# SI unit by contract name.
UNITS = MappingProxyType(
    {
        COMMAND: "V",
        "force_n": "N",
        "position_m": "m",
        "velocity_m_s": "m/s",
        "pressure_a_pa": "Pa",
        "pressure_b_pa": "Pa",
        "supply_pressure_pa": "Pa",
        "supply_flow_m3_s": "m^3/s",
        "flow_a_m3_s": "m^3/s",
        "flow_b_m3_s": "m^3/s",
    }
)


@dataclass(frozen=True)
class Signal:
    """An input or output of the simulator: value of the simulator = scale * SI + offset."""

    name: str
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class SimulatorValue:
    """A value of the simulator that may be wrong."""

    value: float
    """In the unit of the simulator."""
    sigma: float
    """Standard deviation, > 0: of the natural logarithm if `log`, else in the simulator's unit."""
    log: bool = False


@dataclass(frozen=True, eq=False)
class SimulatorSection:
    """The simulator of a rig with `plant = "simulator"`."""

    fmu: str | None = None
    """Path of an FMU as the rig file states it."""
    python: str | None = None
    """FILE:NAME or MODULE:NAME of a class or function, as the rig file states it."""
    function: Callable[..., Any] | None = None
    """A class, an object or a function that a program passed; no rig file has it."""
    base: Path = Path()
    """Folder that paths are relative to."""
    step_s: float | None = None
    """Longest communication step, s; None is the sampling time of the record."""
    scales: Mapping[str, float] = field(default_factory=dict)
    """`force_n` and `flow_m3_s` of the machine, with which the sizes of effects are compared."""
    inputs: Mapping[str, Signal] = field(default_factory=dict)
    outputs: Mapping[str, Signal] = field(default_factory=dict)
    ports: Mapping[str, Signal] = field(default_factory=dict)
    start: Mapping[str, Signal] = field(default_factory=dict)
    """Values that state where a run begins, by contract name; only `position_m`."""
    constants: Mapping[str, float] = field(default_factory=dict)
    """Other values of the simulator, never fitted, by its own names."""
    valve_bandwidth: str | None = None
    """Name among `parameters` of the value that is the bandwidth of the valve, Hz."""
    valve_damping: float | str | None = None
    """Damping ratio of the valve, or the name among `parameters` of the value that is it."""
    parameters: Mapping[str, SimulatorValue] = field(default_factory=dict)
    """Values that may be wrong, by the simulator's own names."""
    tolerance: float | None = None
    """Share of the motion to which this simulator is exact; None is the usual one."""

    def __post_init__(self) -> None:
        for name in (
            *("scales", "inputs", "outputs", "ports", "start", "constants", "parameters"),
        ):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def __reduce__(self) -> tuple[Callable[..., SimulatorSection], tuple[dict[str, Any]]]:
        # A mapping proxy cannot be pickled. Another process receives plain dictionaries.
        plain = {
            name: dict(value) if isinstance(value, MappingProxyType) else value
            for name, value in self.__dict__.items()
        }
        return _from_plain, (plain,)

    @property
    def path(self) -> Path:
        """Path of the FMU."""
        return Path(os.path.normpath(self.base / (self.fmu or "")))

    @property
    def what(self) -> str:
        """The program for people, as the rig file states it."""
        return str(self.fmu or self.python or getattr(self.function, "__name__", "simulator"))


def _from_plain(plain: dict[str, Any]) -> SimulatorSection:
    return SimulatorSection(**plain)


def full_name(name: str) -> ParameterKey:
    """Returns the full name in `Rig.values` of a value of the simulator."""
    return ParameterKey(PREFIX + name)


def own_name(key: str) -> str | None:
    """Returns the simulator's own name of a value in `Rig.values`; None for other values."""
    return key.removeprefix(PREFIX) if key.startswith(PREFIX) else None
