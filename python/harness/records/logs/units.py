# SPDX-License-Identifier: MIT
"""Units as engineers write them, in the notation of pint."""

from __future__ import annotations

import re
from types import MappingProxyType

import numpy as np

from ehsid.harness.catalogue.channels import CHANNELS, COMMAND
from ehsid.harness.records.layout import ColumnMap, in_schema_unit, is_convertible

# Spelling in a log -> notation of pint. What pint reads as it stands needs no line here.
_SPELLINGS = MappingProxyType(
    {
        "sec": "s", "secs": "s", "seconds": "s", "second": "s", "sek": "s", "msec": "ms",
        "millis": "ms", "milliseconds": "ms", "usec": "us", "µs": "us", "μs": "us",
        "µm": "um", "μm": "um", "inch": "inch", "in": "inch", '"': "inch", "meter": "m",
        "bara": "bar", "bar abs": "bar", "bar(a)": "bar", "bara.": "bar", "barg": "barg",
        "bar(g)": "barg", "bar g": "barg", "bar rel": "barg", "psia": "psi", "psig": "psig",
        "psi(g)": "psig", "lbf/in^2": "psi", "n/mm^2": "MPa", "n/mm2": "MPa", "n/mm²": "MPa",
        "mpa": "MPa", "kp/cm2": "kgf/cm**2", "kp/cm²": "kgf/cm**2", "kgf/cm2": "kgf/cm**2",
        "volt": "V", "volts": "V", "mm/sec": "mm/s", "m/sec": "m/s", "mm s-1": "mm/s",
        "m s-1": "m/s", "m/s": "m/s", "kp": "kgf", "lbs": "lbf", "newton": "N", "kips": "kip",
        "%": "percent", "pct": "percent", "prozent": "percent", "°c": "degC", "deg c": "degC",
        "degc": "degC", "c": "degC", "celsius": "degC", "grad c": "degC", "k": "kelvin",
        "°f": "degF", "degf": "degF", "f": "degF", "-": "1", "1": "1", "": "1", "frac": "1",
    }
)  # fmt: skip
# Masses on the display of a force sensor.
_FORCES = MappingProxyType(
    {"t": "force_metric_ton", "to": "force_metric_ton", "ton": "force_metric_ton",
     "tonne": "force_metric_ton", "kg": "kgf", "lb": "lbf", "g": "gram_force"}
)  # fmt: skip
# What may end a name without brackets, as in "position_mm"; longer words are words.
_ENDING_WORDS = """
s ms us ns min h m mm cm um in inch pa kpa mpa bar barg bara psi psig v mv n kn mn lbf kgf t kg k c
degc degf percent pct a ma m_s mm_s cm_s
"""
_ENDINGS = frozenset(_ENDING_WORDS.split())
_BRACKETS = re.compile(
    r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*(?:\([^()]*\))?)\))\s*$"
)
_SLASH = re.compile(r"^(?P<name>.+?)\s*(?:\s/\s|\sin\s|,\s)\s*(?P<unit>\S{1,8})\s*$")
# Units of a command that no rule converts into volts: the number is kept.
_OF_COMMANDS = frozenset({"mA", "A", "percent", "1", "percent of rated"})


def pint_unit(text: str, channel: str) -> str | None:
    """Returns the notation of pint for a unit of a channel as a log has it; None if it is none.

    "1" stands for a plain number, for a command also the units that are not converted.
    """
    stripped = text.strip().strip("[]").strip()
    known = _SPELLINGS.get(stripped) or _SPELLINGS.get(stripped.casefold())
    candidates = [known] if known else []
    if CHANNELS[channel].unit == "N":
        candidates += [_FORCES[f] for f in (stripped.casefold(),) if f in _FORCES]
    candidates += [stripped, stripped.replace("^", "**"), _folded(stripped)]
    for unit in candidates:
        if channel == COMMAND and unit in _OF_COMMANDS:
            return unit
        if unit == "1":
            if CHANNELS[channel].unit == "1":
                return "1"
        elif is_convertible(unit, CHANNELS[channel].unit):
            return unit
    return None


def _folded(text: str) -> str:
    """Returns a unit in capital letters, such as BAR or KN, as it is usually written."""
    usual = ("mm", "cm", "bar", "psi", "kPa", "MPa", "kN", "Pa", "ms", "mV", "mm/s", "m/s", "inch")
    return next((unit for unit in usual if unit.casefold() == text.casefold()), text)


def split_unit(name: str) -> tuple[str, str | None]:
    """Returns the name without the unit in brackets or behind a slash, and the unit or None."""
    for pattern in (_BRACKETS, _SLASH):
        match = pattern.match(name)
        if match and match["name"].strip():
            groups = match.groupdict()
            unit = next((groups[key] for key in ("a", "b", "unit") if groups.get(key)), None)
            return match["name"].strip(), unit
    return name, None


def without_unit(name: str, channel: str) -> str:
    """Returns the name of a column without its unit; A is none in "Druck (A)"."""
    label, unit = split_unit(name)
    return name if unit is None or pint_unit(unit, channel) is None else label


def split_ending(name: str) -> tuple[str, str | None]:
    """Returns a name such as "position_mm" as ("position", "mm"); (name, None) if none ends it."""
    for count in (2, 1):
        parts = re.split(r"[_\s.]+", name)
        if len(parts) > count and "_".join(parts[-count:]).casefold() in _ENDINGS:
            unit = "/".join(parts[-count:])
            return "_".join(parts[:-count]), unit
    return name, None


def conversion(unit: str | None, channel: str) -> tuple[float, float]:
    """Returns factor and offset from a unit in the notation of pint to that of the channel."""
    column = ColumnMap("", None if unit == "1" or not converts(unit, channel) else unit)
    zero, one = in_schema_unit(np.array([0.0, 1.0]), column, CHANNELS[channel].unit)
    return float(one - zero), float(zero)


def converts(unit: str | None, channel: str) -> bool:
    """Whether a unit is converted; a command in mA keeps its numbers."""
    return unit is not None and is_convertible(unit, CHANNELS[channel].unit)


def looks_like_a_unit(text: str) -> bool:
    """Whether a cell below a name can be a unit: "mm", "[bar]", "-" or nothing."""
    stripped = text.strip().strip("[]()").strip()
    if stripped in ("", "-") or stripped.casefold() in _SPELLINGS or stripped in _FORCES:
        return True
    return any(pint_unit(stripped, channel) for channel in CHANNELS) or stripped in (
        *("l/min", "L/min", "lpm", "gpm", "Hz", "rpm", "1/min", "mA", "A", "deg", "°", "Nm", "W"),
        *("kW", "g", "m/s²", "m/s^2", "m/s2", "rad", "l", "cm³", "m³/s", "m3/s", "counts"),
    )
