# SPDX-License-Identifier: MIT
"""What may stand in a rig, by the compiled plant. Each check finds all problems, not the first."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from ehsid.harness.records.errors import nearest_name
from ehsid.harness.rigs.parameters import (
    EFFECT_PREFIX,
    NUISANCE_PREFIX,
    belongs_to,
    effects,
    is_rig_value,
    plant_parameters,
)

SENSORS = (
    "position_noise_m",
    "velocity_noise_m_s",
    "pressure_a_noise_pa",
    "pressure_b_noise_pa",
    "supply_pressure_noise_pa",
    "spool_noise",
)


def unknown(key: str, existing: Iterable[str]) -> str:
    """A key that nothing knows, with the nearest that exists."""
    nearest = nearest_name(key, existing)
    hint = f"; did you mean '{nearest}'?" if nearest else ""
    return f"'{key}' is not known{hint}"


def not_a_number(key: str, value: object) -> str | None:
    """Is the value no finite number?"""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"'{key}' = {value!r}: expected a number"
    return None if math.isfinite(value) else f"'{key}' = {value}: expected a finite number"


def check_values(values: Mapping[str, object]) -> list[str]:
    """Names and ranges of values by full name. Zero switches an effect off, whatever its range."""
    problems = []
    for name, value in values.items():
        parameter = plant_parameters().get(name)
        if parameter is None:
            problems.append(_unknown_value(name))
            continue
        wrong = not_a_number(name, value)
        if wrong is not None:
            problems.append(wrong)
            continue
        assert isinstance(value, int | float)
        off = name.startswith((EFFECT_PREFIX, NUISANCE_PREFIX)) and value == 0.0
        if not off and not parameter.minimum <= value <= parameter.maximum:
            problems.append(
                f"'{name}' = {value:g}: expected {parameter.minimum:g} to {parameter.maximum:g} "
                f"{parameter.unit} ({parameter.meaning})"
            )
    return problems


def _unknown_value(name: str) -> str:
    if not name.startswith(EFFECT_PREFIX):
        return unknown(name, plant_parameters())
    effect = name.split(".")[1]
    if effect not in effects():
        nearest = nearest_name(effect, effects())
        hint = f"; did you mean '{nearest}'?" if nearest else ""
        return f"'{EFFECT_PREFIX}{effect}' is no effect of the catalogue{hint}"
    names = [f"{EFFECT_PREFIX}{effect}.{p.name}" for p in effects()[effect].parameters]
    return unknown(name, names)


def check_complete(values: Mapping[str, object], plant: str) -> list[str]:
    """Everything the plant needs is told, nothing it does not have."""
    problems = [
        f"'{name}' is missing ({parameter.meaning}, in {parameter.unit})"
        for name, parameter in plant_parameters().items()
        if belongs_to(name, plant) and name not in values
    ]
    problems += [
        f"'{name}': a plant \"{plant}\" has no such value"
        for name in values
        if name in plant_parameters() and is_rig_value(name) and not belongs_to(name, plant)
    ]
    return problems


def check_together(values: Mapping[str, object]) -> list[str]:
    """What values must be to each other."""

    def number(name: str) -> float | None:
        value = values.get(name)
        return None if not_a_number(name, value) else float(value)  # type: ignore[arg-type]

    def below(small: str, large: str) -> list[str]:
        low, high = number(small), number(large)
        if low is None or high is None or low < high:
            return []
        return [f"'{small}' = {low:g} must be below '{large}' = {high:g}"]

    problems = below("cylinder.rod_m", "cylinder.bore_m")
    problems += below("supply.tank_pressure_pa", "supply.pressure_pa")
    stribeck = f"{EFFECT_PREFIX}stribeck_friction"
    static, coulomb = number(f"{stribeck}.static_n"), number(f"{stribeck}.coulomb_n")
    if static is not None and coulomb is not None and static < coulomb:
        problems.append(
            f"'{stribeck}.static_n' = {static:g} must not be below coulomb_n = {coulomb:g}"
        )
    problems += _whole_effects(values)
    return problems


def _whole_effects(values: Mapping[str, object]) -> list[str]:
    """An effect that is on needs the parameters that have no zero in their range."""
    problems = []
    for effect in effects().values():
        names = {p.name: f"{EFFECT_PREFIX}{effect.id}.{p.name}" for p in effect.parameters}
        if not any(values.get(full) for full in names.values()):
            continue
        problems += [
            f"'{names[p.name]}' is missing: {p.meaning}, {p.minimum:g} to {p.maximum:g} {p.unit}"
            for p in effect.parameters
            if p.minimum > 0.0 and not values.get(names[p.name])
        ]
    return problems
