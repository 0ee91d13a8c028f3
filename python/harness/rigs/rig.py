# SPDX-License-Identifier: MIT
"""A rig: values by full name, what is known of them, and how its records are laid out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ehsid.harness.records import ColumnMap
from ehsid.harness.rigs.errors import RigError
from ehsid.harness.rigs.parameters import (
    DEFAULT_EFFECT_UNCERTAINTY,
    DEFAULT_UNCERTAINTY,
    EFFECT_PREFIX,
    INITIAL_PREFIX,
    NUISANCE_PREFIX,
    plant_parameters,
)

PlantName = Literal["ehs", "axis", "linear"]


@dataclass(frozen=True, eq=False)
class Rig:
    """What the simulator is told about a machine.

    Attributes
    ----------
    name
        of the machine.
    plant
        "ehs", "axis" or "linear".
    values
        SI, by full name, e.g. "load.mass_kg" or "effects.valve_lag.bandwidth_hz". An effect that is
        not there is off.
    uncertainty
        relative 1-sigma of a value, by full name; see `sigma` for those not named.
    sensors
        what is known of the sensors, e.g. "position_noise_m".
    columns
        layout of the records, by name of the schema: the `layout` of `read_record`.
    """

    name: str
    plant: PlantName
    values: Mapping[str, float]
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    sensors: Mapping[str, float] = field(default_factory=dict)
    columns: Mapping[str, ColumnMap] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("values", "uncertainty", "sensors", "columns"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def __reduce__(self) -> tuple[type[Rig], tuple[Any, ...]]:
        # A mapping proxy cannot be pickled: to another process go plain dictionaries.
        mappings = (self.values, self.uncertainty, self.sensors, self.columns)
        return Rig, (self.name, self.plant, *(dict(mapping) for mapping in mappings))

    def with_values(self, values: Mapping[str, float]) -> Rig:
        """The same rig with other values, by full name.

        Raises
        ------
        RigError
            a name the plant does not have, a value outside its range, or values that contradict
            each other.
        """
        from ehsid.harness.rigs.checks import check_complete, check_together, check_values

        together = {**self.values, **values}
        problems = check_values(values) + check_complete(together, self.plant)
        problems += check_together(together)
        if problems:
            raise RigError(self.name, problems)
        return replace(self, values={k: float(value) for k, value in together.items()})

    def sigma(self, name: str) -> float:
        """Relative 1-sigma of a value."""
        if name in self.uncertainty:
            return self.uncertainty[name]
        return DEFAULT_UNCERTAINTY.get(name, DEFAULT_EFFECT_UNCERTAINTY)

    def effects(self) -> tuple[str, ...]:
        """Ids of the effects that are on."""
        ids = [
            name.split(".")[1]
            for name, value in self.values.items()
            if name.startswith(EFFECT_PREFIX) and value != 0.0
        ]
        return tuple(dict.fromkeys(ids))

    def plant_values(self, more: Mapping[str, float] | None = None) -> npt.NDArray[np.float64]:
        """All values in the order of `ehsid.plant_parameters()`, shape (P,).

        What the rig does not tell: effects are off, nuisances and the start at their typical values
        (a start at mid-stroke). `more` overrides by full name.
        """
        start = 0.5 * self.values.get("cylinder.stroke_m", 0.0)
        told = {f"{INITIAL_PREFIX}position_m": start, **self.values, **(more or {})}
        unknown = sorted(told.keys() - plant_parameters().keys())
        if unknown:
            raise KeyError(unknown[0])
        return np.array(
            [
                told.get(name, 0.0 if name.startswith(EFFECT_PREFIX) else parameter.typical)
                for name, parameter in plant_parameters().items()
            ]
        )

    def nuisances(self) -> tuple[str, ...]:
        """Full names of what no data sheet tells."""
        return tuple(name for name in plant_parameters() if name.startswith(NUISANCE_PREFIX))
