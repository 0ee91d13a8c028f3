# SPDX-License-Identifier: MIT
"""Checks a rig against the compiled plant; one exception reports all that is wrong with it."""

from __future__ import annotations

import datetime
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import ehsid

from ..catalogue.channels import CHANNELS
from ..catalogue.parameters import (
    belongs_to,
    effects,
    may_have,
    missing_part,
    names_of,
    plant_parameters,
)
from ..catalogue.spellings import ParameterKey
from ..records import RecordError
from ..records.errors import Limit, nearest_name, read_file

# More problems than this are counted in the message, not listed.
MOST_LISTED = 20


class RigError(ValueError):
    """A rig that cannot be read, written or simulated as it is.

    Attributes
    ----------
    source
        path of the rig file, or name of a rig made in memory.
    problems
        the problems, one line each: key, value, and what was expected.
    """

    def __init__(self, source: object, problems: Sequence[str]) -> None:
        self.source = str(source)
        # A quoted TOML key may contain any character, also line ends. Characters that cannot be
        # printed are escaped, so that each problem stays on one line.
        printable = ("".join(c if c.isprintable() else repr(c)[1:-1] for c in p) for p in problems)
        self.problems = tuple(dict.fromkeys(printable))
        lines = "".join(f"\n  {problem}" for problem in self.problems[:MOST_LISTED])
        if len(self.problems) > MOST_LISTED:
            lines += f"\n  and {len(self.problems) - MOST_LISTED} more"
        super().__init__(
            f"{self.source}: {lines.strip()}"
            if len(self.problems) == 1
            else f"{self.source}: {len(self.problems)} problems{lines}"
        )

    def __reduce__(self) -> tuple[type[RigError], tuple[str, tuple[str, ...]]]:
        """Keeps both arguments in pickling; by default an exception is rebuilt from `args` only."""
        return RigError, (self.source, self.problems)


RIG_BYTES = Limit("EHSID_MAX_RIG_BYTES", 2**20, "bytes")
# More dots than this are in no key of a rig. The parser takes time with the square of their number.
MOST_DOTS = 100
# A rig has fewer than a hundred values. For each unknown key the nearest known one is looked for.
MOST_KEYS = 1000
UTF8_BOM = b"\xef\xbb\xbf"
EXPECTED = "expected a rig file (TOML)"
UTF16_BOMS = (b"\xff\xfe", b"\xfe\xff")


def read_text(path: Path) -> str:
    """Returns the content of the file as text.

    Raises
    ------
    RigError
        the path does not exist, is a directory, or cannot be read, or the text is not UTF-8.
    """
    try:
        if path.is_dir():
            raise RigError(path, [f"this is a directory: {EXPECTED}; name one in it"])
        data = read_file(path, RIG_BYTES)
    except FileNotFoundError:
        raise RigError(path, [f"there is no such file: {EXPECTED}; check the path"]) from None
    except RecordError as error:  # its message speaks of records
        mend = "name a rig file (TOML)"
        if "device" not in error.problem:
            mend = f"is it a rig file? If it is meant to be so large, {RIG_BYTES.remedy}"
        raise RigError(path, [f"{error.problem}: expected {error.expected}; {mend}"]) from None
    except RigError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise RigError(path, [f"cannot be read ({reason}): {EXPECTED}; check the path"]) from None
    if data.startswith(UTF16_BOMS):
        raise RigError(path, ["the text is UTF-16: expected UTF-8; save it as UTF-8"])
    data = data.removeprefix(UTF8_BOM)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - data.rfind(b"\n", 0, error.start)
        raise RigError(
            path,
            [
                f"line {line}, column {column}: byte 0x{data[error.start]:02x} is not UTF-8 text: "
                f"{EXPECTED}; save it as UTF-8"
            ],
        ) from None


def parse_toml(text: str, source: object) -> dict[str, Any]:
    """Returns the tables of a TOML document.

    Raises
    ------
    RigError
        the text is not TOML, and the message gives line and column of a syntax error; keys or
        brackets are nested too deeply; or there are too many keys.
    """
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > MOST_DOTS and not line.lstrip().startswith("#"):
            raise RigError(
                source,
                [
                    f"line {number}: {line.count('.')} dots: expected keys of a few parts, such as "
                    '"fluid.bulk_modulus_pa"; correct the line'
                ],
            )
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        problem = _syntax_problem(str(error), text)
    except RecursionError:
        problem = "not TOML: brackets are nested too deeply; expected the sections of docs/rigs.md"
    except ValueError:
        problem = "not TOML: a number has thousands of digits; expected numbers in SI units"
    else:
        keys = _count_keys(document)
        if keys <= MOST_KEYS:
            return document
        problem = (
            f"{keys} keys: expected at most {MOST_KEYS}, those of one machine; is it a rig file?"
        )
    raise RigError(source, [problem])


def _syntax_problem(problem: str, text: str) -> str:
    """Returns an error of the parser with its place in front and the line in question behind."""
    lines = text.split("\n")
    problem, _, place = problem.rpartition(" (at ")
    found = re.fullmatch(r"line (\d+), column (\d+)\)", place)
    line, column = (int(found[1]), int(found[2])) if found else (len(lines), len(lines[-1]) + 1)
    end = "" if found else ", the end of the file"
    written = lines[line - 1].strip() if line <= len(lines) else ""
    shown = written if len(written) <= 60 else written[:57] + "..."
    return (
        f"line {line}, column {column}{end}: not TOML: {problem}"
        + (f"; the line is {shown!r}" if shown else "")
        + ": expected [section] or key = value, each once; the value is a number with a decimal "
        "point and no unit, or text in quotation marks"
    )


def _count_keys(document: dict[str, Any]) -> int:
    """Returns the number of keys in all tables that are not in lists."""
    count, waiting = 0, [document]
    while waiting:
        table = waiting.pop()
        count += len(table)
        waiting += [value for value in table.values() if isinstance(value, dict)]
    return count


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


def may_be_off(name: str) -> bool:
    """Returns whether a value may be 0, which switches something off, whatever its range."""
    return ParameterKey(name).effect is not None or name == HIDDEN_SPOOL


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
        is_off = value == 0.0 and may_be_off(name)
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
        if name in plant_parameters() and not may_have(name, plant)
    ]
    problems += [
        f"'effects.{effect.id}': a plant \"{plant}\" has no {part}; remove it, or correct 'plant'"
        for effect in effects().values()
        if (part := missing_part(effect, plant)) is not None
        and any(values.get(name) for name in names_of(effect))
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
