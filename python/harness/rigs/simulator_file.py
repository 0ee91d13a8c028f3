# SPDX-License-Identifier: MIT
"""Reads and writes the sections `[simulator]` of a rig file.

Nothing of the user's program runs here: an FMU is read as the description that it has, and a Python
file as text.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..records.units import EXAMPLES, in_schema_unit, is_convertible, usual_units
from ..simulators.source import read_place
from .checks import not_a_number, unknown, value_text
from .simulator_names import Program, program_of_fmu, program_of_python
from .simulator_section import (
    COMMAND,
    OUTPUTS,
    PORTS,
    PREFIX,
    UNITS,
    Signal,
    SimulatorSection,
    SimulatorValue,
    full_name,
)

SECTION = "simulator"
KEYS = ("fmu", "python", "step_s", "tolerance")
TABLES = ("scales", "inputs", "outputs", "ports", "start", "constants", "valve_lag", "parameters")
SCALES = ("force_n", "flow_m3_s")
OF_VALUE = ("value", "sigma", "log")
LARGEST_TOLERANCE = 0.2
POSITION = "position_m"


def parse_simulator(
    given: object, folder: Path, problems: list[str]
) -> tuple[SimulatorSection | None, Program]:
    """Returns the section of a rig with `plant = "simulator"`; appends all problems.

    Parameters
    ----------
    given
        the section as TOML has it; None without one.
    folder
        that of the rig file, which paths are relative to.
    problems
        list that all problems are appended to; without a new one, a section is returned.
    """
    if not isinstance(given, dict):
        stated = "is missing" if given is None else f"= {value_text(given)}"
        problems.append(
            f"'{SECTION}' {stated}: expected a section [{SECTION}] with fmu = \"FILE.fmu\" or "
            'python = "FILE.py:NAME"'
        )
        return None, Program()
    before = len(problems)
    problems += [
        f"{SECTION}: {unknown(key, (*KEYS, *TABLES))}"
        for key in given
        if key not in (*KEYS, *TABLES)
    ]
    program = _program(given, folder, problems)
    tables = {name: _table(given, name, problems) for name in TABLES}
    scales = _numbers("scales", tables["scales"], problems, above_zero=True)
    problems += [f"{SECTION}.scales: {unknown(key, SCALES)}" for key in scales if key not in SCALES]
    signals = {
        "inputs": _signals("inputs", tables["inputs"], (COMMAND,), problems),
        "outputs": _signals("outputs", tables["outputs"], OUTPUTS, problems),
        "ports": _signals("ports", tables["ports"], PORTS, problems),
        "start": _signals("start", tables["start"], (POSITION,), problems),
    }
    _check_signals(signals, tables, program, problems)
    constants = _numbers("constants", flat(tables["constants"]), problems)
    for name in constants:
        problems += program.constant(f"{SECTION}.constants.{name}", name)
    parameters = _parameters(tables["parameters"], program, problems)
    twice = [name for name in constants if name in parameters]
    problems += [
        f"'{SECTION}.constants.{name}': it stands in [{SECTION}.parameters], too: remove one"
        for name in twice
    ]
    bandwidth, damping = _valve_lag(tables["valve_lag"], tables["parameters"], problems)
    step = _number(given, "step_s", problems)
    if step is not None and step <= 0.0:
        problems.append(f"'{SECTION}.step_s' = {step!r}: expected seconds, above 0")
    tolerance = _number(given, "tolerance", problems)
    if tolerance is not None and not 0.0 < tolerance <= LARGEST_TOLERANCE:
        problems.append(
            f"'{SECTION}.tolerance' = {tolerance!r}: expected a share of the motion, above 0, "
            f"{LARGEST_TOLERANCE:g} at most"
        )
    if len(problems) > before:
        return None, program
    return SimulatorSection(
        fmu=given.get("fmu"),
        python=given.get("python"),
        base=folder,
        step_s=step,
        scales=scales,
        inputs=signals["inputs"],
        outputs=signals["outputs"],
        ports=signals["ports"],
        start=signals["start"],
        constants=constants,
        valve_bandwidth=bandwidth,
        valve_damping=damping,
        parameters=parameters,
        tolerance=tolerance,
    ), program


def _program(given: Mapping[str, Any], folder: Path, problems: list[str]) -> Program:
    """Returns the program that the section names, with its names as far as they can be read."""
    stated = [key for key in ("fmu", "python") if key in given]
    wrong = [key for key in stated if not isinstance(given[key], str) or not given[key].strip()]
    if wrong or len(stated) != 1:
        problems += [
            f"'{SECTION}.{key}' = {value_text(given[key])}: expected text, a path" for key in wrong
        ]
        if not wrong:
            has = "both fmu and python" if stated else "neither fmu nor python"
            problems.append(
                f"'{SECTION}' has {has}: expected one of them, the path of an FMU or "
                'python = "FILE.py:NAME"'
            )
        return Program()
    text = given[stated[0]]
    if stated == ["fmu"]:
        return program_of_fmu(text, Path(os.path.normpath(folder / text)), problems)
    return program_of_python(text, folder, problems)


def _table(given: Mapping[str, Any], name: str, problems: list[str]) -> dict[str, Any]:
    table = given.get(name, {})
    if isinstance(table, dict):
        return table
    problems.append(f"'{SECTION}.{name}' = {value_text(table)}: expected [{SECTION}.{name}]")
    return {}


def flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Returns nested tables as one table with dotted names.

    Without quotes, TOML reads the key of fluid.bulk_modulus_pa = 0.3 as nested tables.
    """
    made: dict[str, Any] = {}
    for key, value in table.items():
        name = prefix + key
        made |= flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return made


def _number(given: Mapping[str, Any], key: str, problems: list[str]) -> float | None:
    if key not in given:
        return None
    problem = not_a_number(f"{SECTION}.{key}", given[key])
    if problem is not None:
        problems.append(problem)
        return None
    return float(given[key])


def _numbers(
    name: str, table: Mapping[str, Any], problems: list[str], *, above_zero: bool = False
) -> dict[str, float]:
    numbers: dict[str, float] = {}
    for key, value in table.items():
        full = f"{SECTION}.{name}.{key}"
        # A switch of a simulator is a constant, too.
        problem = None if value in (True, False) and not above_zero else not_a_number(full, value)
        if problem is None and above_zero and not value > 0.0:
            problem = f"'{full}' = {value!r}: expected a number above 0"
        if problem is not None:
            problems.append(problem)
        else:
            numbers[key] = float(value)
    return numbers


def _signals(
    table_name: str, table: Mapping[str, Any], names: tuple[str, ...], problems: list[str]
) -> dict[str, Signal]:
    """Returns inputs or outputs by contract name."""
    signals: dict[str, Signal] = {}
    for key, given in table.items():
        full = f"{SECTION}.{table_name}.{key}"
        if key not in names:
            problems.append(_misplaced(table_name, key, names))
            continue
        entry = {"name": given} if isinstance(given, str) else given
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            problems.append(
                f"'{full}' = {value_text(given)}: expected a name of the simulator, or "
                '{ name = "In1", scale = 10 }'
            )
            continue
        found = _signal(full, key, entry, problems)
        if found is not None:
            signals[key] = found
    return signals


def _misplaced(table_name: str, key: str, names: tuple[str, ...]) -> str:
    """Returns the problem of a contract name that a table does not have."""
    other = {"inputs": PORTS, "outputs": (), "ports": (COMMAND,), "start": ()}[table_name]
    if key in other and key not in names:
        right = "ports" if table_name == "inputs" else "inputs"
        return f"'{SECTION}.{table_name}.{key}': it belongs to [{SECTION}.{right}]"
    return f"{SECTION}.{table_name}: {unknown(key, names)}; expected {', '.join(names)}"


def _signal(
    full: str, contract: str, entry: Mapping[str, Any], problems: list[str]
) -> Signal | None:
    allowed = ("name", "scale", "offset", "unit", *(("positive",) if contract == "force_n" else ()))
    found = [f"{full}: {unknown(key, allowed)}" for key in entry if key not in allowed]
    numbers = {"scale": 1.0, "offset": 0.0}
    for key in numbers:
        if key in entry:
            problem = not_a_number(f"{full}.{key}", entry[key])
            found += [] if problem is None else [problem]
            numbers[key] = float(entry[key]) if problem is None else 1.0
    scale, offset = numbers.values()
    if scale == 0.0:
        found.append(f"'{full}.scale' = 0: expected a number other than 0")
    if "unit" in entry:
        if entry.keys() & {"scale", "offset"}:
            found.append(f"'{full}' has a unit and a scale or an offset: remove one of them")
        elif not is_convertible(entry["unit"], UNITS[contract]):
            found.append(_wrong_unit(full, entry["unit"], UNITS[contract]))
        else:
            scale, offset = _conversion(entry["unit"], UNITS[contract])
    positive = entry.get("positive", "extends")
    if positive not in ("extends", "retracts"):
        found.append(
            f'\'{full}.positive\' = {value_text(positive)}: expected "extends" or "retracts"'
        )
    problems += found
    if found:
        return None
    return Signal(entry["name"], -scale if positive == "retracts" else scale, offset)


def _wrong_unit(full: str, unit: object, si: str) -> str:
    examples = usual_units(unit, si) if si in EXAMPLES else "such as l/min or m^3/s"
    return (
        f"'{full}.unit' = {value_text(unit)}: expected a unit of the same kind as {si}, {examples}"
    )


def _conversion(unit: str, si: str) -> tuple[float, float]:
    """Returns scale and offset with which a number in the unit is scale * SI + offset."""
    zero, one = in_schema_unit(np.array([0.0, 1.0]), unit, si)
    size = float(one - zero)
    return 1.0 / size, -float(zero) / size + 0.0


def _check_signals(
    signals: Mapping[str, Mapping[str, Signal]],
    tables: Mapping[str, Mapping[str, Any]],
    program: Program,
    problems: list[str],
) -> None:
    """Checks that what is needed is there, that no name stands twice, and what the program has."""
    for name, key, why in (
        ("inputs", COMMAND, "the command of the valve"),
        ("outputs", POSITION, "the position of the rod"),
    ):
        if key not in tables[name]:
            problems.append(
                f"'{SECTION}.{name}.{key}' is missing: expected the simulator's name of {why}"
            )
    for together in (("inputs", "ports"), ("outputs",)):
        taken: dict[str, str] = {}
        for name in together:
            for key, signal in signals[name].items():
                full = f"{SECTION}.{name}.{key}"
                if signal.name in taken:
                    problems.append(
                        f"'{full}' = {value_text(signal.name)}: '{taken[signal.name]}' has this "
                        "name, too: expected one name for each"
                    )
                taken[signal.name] = full
    ask = {"inputs": program.input, "ports": program.input, "outputs": program.output}
    for name, asked in ask.items():
        for key, signal in signals[name].items():
            problems += asked(f"{SECTION}.{name}.{key}", signal.name)
    if POSITION in signals["start"]:
        problems += program.position_start(
            f"{SECTION}.start.{POSITION}", signals["start"][POSITION].name
        )


def _tables_of_values(
    table: Mapping[str, Any], prefix: str = ""
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yields each table of a value by name; unquoted, a name with dots is nested tables."""
    for key, entry in table.items():
        name = prefix + key
        if not isinstance(entry, dict):
            yield name, {"value": entry}
            continue
        own = {inner: value for inner, value in entry.items() if not isinstance(value, dict)}
        nested = {inner: value for inner, value in entry.items() if isinstance(value, dict)}
        if own or not nested:
            yield name, own
        yield from _tables_of_values(nested, f"{name}.")


def _parameters(
    table: Mapping[str, Any], program: Program, problems: list[str]
) -> dict[str, SimulatorValue]:
    found = {}
    for name, entry in _tables_of_values(table):
        value = _value(name, entry, program, problems)
        if value is not None:
            found[name] = value
    return found


def _value(
    name: str, entry: Mapping[str, Any], program: Program, problems: list[str]
) -> SimulatorValue | None:
    key = full_name(name)
    wrong = [f"{key}: {unknown(inner, OF_VALUE)}" for inner in entry if inner not in OF_VALUE]
    wrong += program.value(key, name)
    value, sigma, log = entry.get("value"), entry.get("sigma"), entry.get("log", False)
    if not isinstance(log, bool):
        wrong.append(f"'{key}.log' = {value_text(log)}: expected true or false")
    if sigma is None:
        wrong.append(
            f"'{key}.sigma' is missing: expected a standard deviation above 0, of the logarithm "
            "with log = true, else in the unit of the simulator"
        )
    elif not_a_number(f"{key}.sigma", sigma) or sigma <= 0.0:
        wrong.append(f"'{key}.sigma' = {value_text(sigma)}: expected a standard deviation, above 0")
    if value is None:
        value = program.start(name)
        if value is None and not wrong:
            wrong.append(f"'{key}.value' is missing, and the simulator states none: add it")
    else:
        problem = not_a_number(f"{key}.value", value)
        wrong += [] if problem is None else [problem]
    if not wrong and log is True and value is not None and value <= 0.0:
        wrong.append(
            f"'{key}.value' = {value!r}: expected a value above 0, since log = true; or remove log"
        )
    problems += wrong
    if wrong or value is None or sigma is None:
        return None
    return SimulatorValue(float(value), float(sigma), log)


def _valve_lag(
    table: Mapping[str, Any], parameters: Mapping[str, Any], problems: list[str]
) -> tuple[str | None, float | str | None]:
    """Returns the name of the bandwidth of the valve, and its damping."""
    names = [name for name, _ in _tables_of_values(parameters)]
    allowed = ("bandwidth_hz", "damping")
    full = f"{SECTION}.valve_lag"
    problems += [f"{full}: {unknown(key, allowed)}" for key in table if key not in allowed]
    bandwidth, damping = table.get("bandwidth_hz"), table.get("damping")
    if table and bandwidth is None:
        problems.append(
            f"'{full}.bandwidth_hz' is missing: expected the name of a value in "
            f"[{SECTION}.parameters]"
        )
    for key, given in (("bandwidth_hz", bandwidth), ("damping", damping)):
        if given is None:
            continue
        if key == "damping" and not not_a_number(key, given):
            if given <= 0.0:
                problems.append(f"'{full}.{key}' = {given!r}: expected a ratio above 0")
        elif given not in names:
            near = f": {unknown(given, names)}" if isinstance(given, str) else ""
            problems.append(
                f"'{full}.{key}' = {value_text(given)}{near}: expected the name of a value in "
                f"[{SECTION}.parameters]" + (", or a number" if key == "damping" else "")
            )
    return bandwidth, float(damping) if isinstance(damping, int | float) else damping


def simulator_table(
    section: SimulatorSection, values: Mapping[str, float], folder: Path | None
) -> dict[str, Any]:
    """Returns the section as TOML has it.

    Parameters
    ----------
    section
        the simulator.
    values
        of the rig, by full name; they replace those of the section.
    folder
        where the rig file will stand; elsewhere than at `section.base`, paths become absolute.
    """
    table: dict[str, Any] = {}
    if section.fmu is not None:
        table["fmu"] = section.fmu if _is(folder, section.base) else str(section.path.absolute())
    else:
        table["python"] = _python(section, folder)
    for key in ("step_s", "tolerance"):
        if getattr(section, key) is not None:
            table[key] = getattr(section, key)
    for name in ("scales", "constants"):
        if getattr(section, name):
            table[name] = dict(getattr(section, name))
    for name in ("inputs", "outputs", "ports", "start"):
        signals: Mapping[str, Signal] = getattr(section, name)
        if signals:
            table[name] = {key: _written(signal) for key, signal in signals.items()}
    if section.valve_bandwidth is not None:
        table["valve_lag"] = {"bandwidth_hz": section.valve_bandwidth}
        if section.valve_damping is not None:
            table["valve_lag"]["damping"] = section.valve_damping
    if section.parameters:
        table["parameters"] = {
            name: {"value": values.get(PREFIX + name, one.value), "sigma": one.sigma}
            | ({"log": True} if one.log else {})
            for name, one in section.parameters.items()
        }
    return table


def _is(folder: Path | None, base: Path) -> bool:
    return folder is not None and folder.absolute() == base.absolute()


def _python(section: SimulatorSection, folder: Path | None) -> str:
    if section.python is None:
        function = section.function
        name = getattr(function, "__qualname__", type(function).__qualname__)
        return f"{getattr(function, '__module__', '')}:{name}"
    place = read_place(section.python)
    if place is None or not place.is_file or _is(folder, section.base):
        return section.python
    path = Path(os.path.normpath(section.base / place.where)).absolute()
    return f"{path}:{place.name}"


def _written(signal: Signal) -> str | dict[str, Any]:
    if signal.scale == 1.0 and signal.offset == 0.0:
        return signal.name
    parts = {"name": signal.name, "scale": signal.scale, "offset": signal.offset}
    return {key: value for key, value in parts.items() if key == "name" or value != 0.0}


def check_own_values(section: SimulatorSection, values: Mapping[str, object]) -> list[str]:
    """Checks values of the simulator, given by their own names."""
    problems = []
    for name, value in values.items():
        known = section.parameters.get(name)
        if known is None:
            problems.append(unknown(full_name(name), map(full_name, section.parameters)))
            continue
        problem = not_a_number(full_name(name), value)
        if problem is None and known.log and not (isinstance(value, float | int) and value > 0.0):
            problem = f"'{full_name(name)}' = {value_text(value)}: expected a value above 0"
        if problem is not None:
            problems.append(problem)
    return problems
