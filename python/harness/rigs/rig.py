# SPDX-License-Identifier: MIT
"""A rig: values by full name, their uncertainty, the sensors, and the layout of the records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..catalogue.keys import ParameterKey
from ..catalogue.parameters import (
    DEFAULT_EFFECT_UNCERTAINTY,
    DEFAULT_UNCERTAINTY,
    parameter_keys,
    plant_parameters,
)
from ..records import ColumnMap
from .errors import RigError
from .table_law import TableLaw

# A value of the machine is within this many of its stated standard deviations: a fit moves it by no
# more.
MOST_SIGMAS = 4.0

PlantName = Literal["ehs", "axis", "linear"]


@dataclass(frozen=True, eq=False)
class Rig:
    """Description of a machine for the simulator.

    Attributes
    ----------
    name
        name of the machine.
    plant
        type of the plant: "ehs", "axis" or "linear".
    values
        values in SI units by full name, e.g. "load.mass_kg" or "effects.valve_lag.bandwidth_hz".
        An effect without values is off.
    uncertainty
        relative 1-sigma of values, by full name; `sigma` gives the default for other values.
    sensors
        standard deviations of the sensor noise by name, e.g. "position_noise_m".
    columns
        layout of the records by column name of the schema, for the `layout` of `read_record`.
    tables
        terms of the equations that have no name in the catalogue, by their own names.
    """

    name: str
    plant: PlantName
    values: Mapping[str, float]
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    sensors: Mapping[str, float] = field(default_factory=dict)
    columns: Mapping[str, ColumnMap] = field(default_factory=dict)
    tables: Mapping[str, TableLaw] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("values", "uncertainty", "sensors", "columns", "tables"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def __reduce__(self) -> tuple[type[Rig], tuple[Any, ...]]:
        # A mapping proxy cannot be pickled. Another process receives plain dictionaries.
        mappings = (self.values, self.uncertainty, self.sensors, self.columns, self.tables)
        return Rig, (self.name, self.plant, *(dict(mapping) for mapping in mappings))

    def with_values(self, values: Mapping[str, float]) -> Rig:
        """Returns the rig with some values replaced or added, by full name.

        Raises
        ------
        RigError
            the plant does not have a name, a value is outside its range, or values contradict
            each other.
        """
        from .checks import check_complete, check_relations, check_values

        all_values = {**self.values, **values}
        problems = check_values(values) + check_complete(all_values, self.plant)
        problems += check_relations(all_values)
        if problems:
            raise RigError(self.name, problems)
        return replace(self, values={name: float(value) for name, value in all_values.items()})

    def sigma(self, name: str) -> float:
        """Returns the relative 1-sigma of a value; a default if the rig file gives none."""
        if name in self.uncertainty:
            return self.uncertainty[name]
        return DEFAULT_UNCERTAINTY.get(name, DEFAULT_EFFECT_UNCERTAINTY)

    def effects(self) -> tuple[str, ...]:
        """Returns the ids of the effects that are on."""
        ids = (ParameterKey(name).effect for name, value in self.values.items() if value != 0.0)
        return tuple(dict.fromkeys(effect for effect in ids if effect is not None))

    def plant_values(self, overrides: Mapping[str, float] | None = None) -> npt.NDArray[np.float64]:
        """Returns all values in the order of `ehsid.plant_parameters()`, shape (P,).

        For values that the rig does not contain, effects are off and all other values are typical
        ones, except that the start position is mid-stroke. `overrides` has values by full name
        that replace those of the rig.
        """
        start = 0.5 * self.values.get("cylinder.stroke_m", 0.0)
        values = {ParameterKey.of_initial("position_m"): start, **self.values, **(overrides or {})}
        unknown = sorted(values.keys() - plant_parameters().keys())
        if unknown:
            raise KeyError(unknown[0])
        return np.array(
            [
                values.get(key, plant_parameters()[key].typical if key.effect is None else 0.0)
                for key in parameter_keys()
            ]
        )

    def table_shapes(self) -> list[tuple[str, str, tuple[float, ...]]]:
        """Returns the tables but for their values, as `ehsid.simulate_plant` takes them."""
        return [law.shape for law in self.tables.values()]

    def table_values(self) -> npt.NDArray[np.float64]:
        """Returns the values of all tables, one after the other, shape (T,)."""
        return np.array([value for law in self.tables.values() for value in law.values])

    def nuisances(self) -> tuple[str, ...]:
        """Returns the full names of the nuisance parameters, which no data sheet gives."""
        return tuple(key for key in parameter_keys() if key.is_nuisance)
