# SPDX-License-Identifier: MIT
"""Full names of the values of a plant, such as "load.mass_kg" or "effects.valve_lag.damping"."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

Value = TypeVar("Value")

EFFECTS = "effects"
NUISANCE = "nuisance"
INITIAL = "initial"


class ParameterKey(str):
    """Full name of a value: a section, for an effect its id, and the own name of the value.

    It is equal to its text, so that it can be a key of mappings and of files.
    """

    __slots__ = ()

    @classmethod
    def of_effect(cls, effect: str, parameter: str) -> ParameterKey:
        """Returns the full name of a parameter of an effect."""
        return cls(f"{EFFECTS}.{effect}.{parameter}")

    @classmethod
    def of_initial(cls, state: str) -> ParameterKey:
        """Returns the full name of a value of the initial state."""
        return cls(f"{INITIAL}.{state}")

    @property
    def section(self) -> str:
        """Section of the rig file, such as "load" or "effects"."""
        return self.partition(".")[0]

    @property
    def parameter(self) -> str:
        """Own name of the value, without section and effect."""
        return self.rpartition(".")[2]

    @property
    def effect(self) -> str | None:
        """Id of the effect, None for a value that belongs to no effect."""
        parts = self.split(".")
        return parts[1] if parts[0] == EFFECTS and len(parts) > 1 else None

    @property
    def is_nuisance(self) -> bool:
        """Whether it is a value that every real servo has and no data sheet gives."""
        return self.section == NUISANCE

    @property
    def is_initial(self) -> bool:
        """Whether it is a value of the initial state."""
        return self.section == INITIAL

    @property
    def is_rig_value(self) -> bool:
        """Whether it is a value of the machine, not of an effect, nuisance or initial state."""
        return self.section not in (EFFECTS, NUISANCE, INITIAL)


def effect_values(effect: str, sizes: Mapping[str, Value]) -> dict[str, Value]:
    """Returns the sizes of an effect, given by its own names, by their full names."""
    return {ParameterKey.of_effect(effect, name): value for name, value in sizes.items()}


def sizes_of(effect: str, values: Mapping[str, Value]) -> dict[str, Value]:
    """Returns the sizes of an effect by its own names, out of values by full name."""
    keys = {ParameterKey(name): value for name, value in values.items()}
    return {key.parameter: value for key, value in keys.items() if key.effect == effect}
