# SPDX-License-Identifier: MIT
"""Checks a rig against the compiled plant; each check finds all problems, not only the first."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterable, Mapping
from typing import Any

import ehsid

from ..catalogue.channels import CHANNELS
from ..catalogue.parameters import acts_on, belongs_to, effects, names_of, plant_parameters
from ..catalogue.spellings import ParameterKey
from ..records.errors import nearest_name

HIDDEN_SPOOL = "nuisance.spool_bandwidth_hz"

LARGEST_SIGMA = 10.0  # relative; a larger uncertainty gives no information on the value

SENSORS = tuple(channel.noise for channel in CHANNELS.values() if channel.noise is not None)


def unknown(key: str, existing: Iterable[str]) -> str:
    """Returns the problem text for an unknown key, with the nearest existing key."""
    nearest = nearest_name(key, existing)
    hint = f"; did you mean '{nearest}'?" if nearest else ""
    return f"'{key}' is not known{hint}"


def value_text(value: object) -> str:
    """Returns the value as text for a message, cut to 60 characters."""
    text = repr(value)
    if isinstance(value, bool):
        text = text.lower()
    elif isinstance(value, datetime.date | datetime.time):
        text = value.isoformat()
    return text if len(text) <= 60 else text[:57] + "..."


def not_a_number(key: str, value: object) -> str | None:
    """Returns the problem text if the value is not a finite number, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"'{key}' = {value_text(value)}: expected a number"
    try:
        finite = math.isfinite(value)
    except OverflowError:  # TOML has integers of any length
        return f"'{key}': expected a number that float64 can hold"
    return None if finite else f"'{key}' = {value}: expected a finite number"


def _range(parameter: ehsid.PlantParameter) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{parameter.minimum:g} to {parameter.maximum:g}{unit} ({parameter.meaning})"


def check_values(values: Mapping[str, object]) -> list[str]:
    """Checks names and ranges of values, given by full name.

    The value 0 is always allowed for an effect and for the bandwidth of the hidden spool, whatever
    their range: it switches them off.
    """
    problems = []
    for name, value in values.items():
        parameter = plant_parameters().get(name)
        if parameter is None:
            problems.append(_unknown_value(name))
            continue
        problem = not_a_number(name, value)
        if problem is not None:
            problems.append(problem)
            continue
        assert isinstance(value, int | float)
        is_off = value == 0.0 and (ParameterKey(name).effect is not None or name == HIDDEN_SPOOL)
        if not is_off and not parameter.minimum <= value <= parameter.maximum:
            problems.append(f"'{name}' = {value!r}: expected {_range(parameter)}")
    return problems


def unknown_effect(effect: str) -> str:
    """Returns the problem text for an unknown effect, with the nearest effect of the catalogue."""
    nearest = nearest_name(effect, effects())
    hint = f"; did you mean '{nearest}'?" if nearest else ""
    return f"'effects.{effect}' is no effect of the catalogue{hint}"


def _unknown_value(name: str) -> str:
    effect = ParameterKey(name).effect
    if effect is None:
        return unknown(name, plant_parameters())
    if effect not in effects():
        return unknown_effect(effect)
    return unknown(name, names_of(effects()[effect]))


def check_complete(values: Mapping[str, object], plant: str) -> list[str]:
    """Checks that the rig has every value the plant needs, and none the plant does not have."""
    problems = [
        f"'{name}' is missing: expected {_range(parameter)}"
        for name, parameter in plant_parameters().items()
        if belongs_to(name, plant) and name not in values
    ]
    problems += [
        f"'{name}': a plant \"{plant}\" has no such value; remove it, or correct 'plant'"
        for name in values
        if name in plant_parameters()
        and ParameterKey(name).is_rig_value
        and not belongs_to(name, plant)
    ]
    problems += [
        f"'effects.{effect.id}': a plant \"{plant}\" has no {effect.subsystem}; remove it, "
        "or correct 'plant'"
        for effect in effects().values()
        if not acts_on(effect, plant) and any(values.get(name) for name in names_of(effect))
    ]
    return problems


def check_uncertainty(
    uncertainty: Mapping[str, Any], values: Mapping[str, object], plant: object
) -> list[str]:
    """Checks that each uncertainty is a relative 1-sigma of a value of the rig."""
    problems = []
    for name, sigma in uncertainty.items():
        if name not in plant_parameters():
            problems.append(f"uncertainty: {_unknown_value(name)}")
        elif name not in values and not belongs_to(name, str(plant)):
            problems.append(f"uncertainty '{name}': the rig does not tell this value")
        elif not_a_number(name, sigma) or not 0.0 < sigma <= LARGEST_SIGMA:
            problems.append(
                f"uncertainty '{name}' = {value_text(sigma)}: expected a relative 1-sigma above 0, "
                f"{LARGEST_SIGMA:g} at most"
            )
    return problems


def check_sensors(sensors: Mapping[str, Any]) -> list[str]:
    """Checks that each entry is the standard deviation of the noise of a known sensor."""
    problems = []
    for key, noise in sensors.items():
        if key not in SENSORS:
            problems.append(f"sensors: {unknown(key, SENSORS)}")
        elif not_a_number(key, noise) or noise < 0.0:
            problems.append(
                f"'sensors.{key}' = {value_text(noise)}: expected a standard deviation, >= 0"
            )
    return problems


def check_relations(values: Mapping[str, object]) -> list[str]:
    """Checks the relations between values, such as a rod diameter below the bore diameter."""

    def number(name: str) -> float | None:
        value = values.get(name)
        return None if not_a_number(name, value) else float(value)  # type: ignore[arg-type]

    def below(small: str, large: str) -> list[str]:
        low, high = number(small), number(large)
        if low is None or high is None or low < high:
            return []
        return [f"'{small}' = {low!r} must be below '{large}' = {high!r}"]

    problems = below("cylinder.rod_m", "cylinder.bore_m")
    problems += below("supply.tank_pressure_pa", "supply.pressure_pa")
    for effect in effects().values():
        for larger, smaller in effect.not_below:
            large = ParameterKey.of_effect(effect.id, larger)
            low = number(ParameterKey.of_effect(effect.id, smaller))
            high = number(large) if large in values else 0.0
            if high is not None and low is not None and high < low:
                problems.append(f"'{large}' = {high:g} must not be below {smaller} = {low:g}")
    problems += _whole_effects(values)
    return problems


def _whole_effects(values: Mapping[str, object]) -> list[str]:
    """Checks that active effects have all parameters whose range does not include 0."""
    problems = []
    for effect in effects().values():
        if not any(values.get(name) for name in names_of(effect)):
            continue
        problems += [
            f"'{name}' is missing: expected {_range(parameter)}"
            for name, parameter in zip(names_of(effect), effect.parameters, strict=True)
            if parameter.minimum > 0.0 and not values.get(name)
        ]
    return problems
