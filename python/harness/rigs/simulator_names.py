# SPDX-License-Identifier: MIT
"""Whether a user's simulator has the names that a rig file states, told without running it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from ..records.errors import nearest_name
from ..simulators.description import (
    REAL,
    Description,
    FmuError,
    Variable,
    platform_names,
    read_description,
)
from ..simulators.source import Source, SourceError, read_place, read_source
from .checks import value_text

# More names than this are no help in a message.
MOST_NAMES = 8


class Program:
    """A simulator whose names are not known, such as a class of an installed module."""

    def input(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with an input of this name, for the key of the rig file."""
        return []

    def output(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with an output of this name."""
        return []

    def value(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with a real value of this name that is set before a run."""
        return []

    def constant(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with a value of this name that is never fitted."""
        return []

    def position_start(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with a value of this name that states where a run begins."""
        return []

    def start(self, name: str) -> float | None:
        """Returns the value that the simulator states for a name; None if it states none."""
        return None


class FmuProgram(Program):
    """An FMU, with the names of its description."""

    def __init__(self, description: Description) -> None:
        self.description = description

    def input(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with an input of this name."""
        return self._real(key, name, ("input",), "an input")

    def output(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with an output of this name; an inner variable can be read, too."""
        return self._real(key, name, ("output", "local"), "an output")

    def value(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with a real value of this name that is set before a run."""
        return self._settable(key, name) or self._not_real(key, self._variables[name])

    def position_start(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with a value of this name that states where a run begins."""
        return self._settable(key, name, name) or self._not_real(key, self._variables[name])

    def constant(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with a value of this name that is never fitted."""
        problems = self._settable(key, name)
        if not problems and self._variables[name].kind == "other":
            return [f"'{key}': it is a {self._variables[name].type_name}: expected a number"]
        return problems

    def start(self, name: str) -> float | None:
        """Returns the start value of the description."""
        variable = self._variables.get(name)
        return None if variable is None else variable.start

    @property
    def _variables(self) -> Mapping[str, Variable]:
        return self.description.variables

    def _real(self, key: str, name: str, causalities: tuple[str, ...], what: str) -> list[str]:
        variable = self._variables.get(name)
        of_kind = [v.name for v in self._variables.values() if v.causality == causalities[0]]
        if variable is None:
            return [_no_name(key, name, "the FMU has no variable of this name", of_kind, what)]
        if variable.causality not in causalities:
            return [
                f"'{key}' = {value_text(name)}: it is {_article(variable.causality)} of the FMU: "
                f"expected {what}{_listed(of_kind)}"
            ]
        return self._not_real(key, variable)

    def _settable(self, key: str, name: str, stated: str | None = None) -> list[str]:
        variable = self._variables.get(name)
        values = [v.name for v in self._variables.values() if v.causality == "parameter"]
        if variable is None:
            why = "the FMU has no variable of this name"
            return [_no_name(key, stated, why, values, name)]
        if not variable.is_settable:
            what = "constant" if variable.variability == "constant" else variable.causality
            return [
                f"'{key}': it is {_article(what)} of the FMU: expected a value that may be set "
                f"before a run{_listed(values)}"
            ]
        return []

    def _not_real(self, key: str, variable: Variable) -> list[str]:
        if variable.kind == REAL:
            return []
        return [
            f"'{key}': the variable {value_text(variable.name)} of the FMU is of the type "
            f"{variable.type_name}: expected a real number that is no array"
        ]


class PythonProgram(Program):
    """A class in a Python file, with the names that its text states."""

    def __init__(self, source: Source) -> None:
        self.source = source

    def input(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with an input of this name."""
        return self._among(key, name, self.source.inputs, "inputs")

    def output(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with an output of this name."""
        return self._among(key, name, self.source.outputs, "outputs")

    def value(self, key: str, name: str) -> list[str]:
        """Returns what is wrong with a value of this name."""
        known = self.source.parameters
        if not known or name in known:
            return []
        return [_no_name(key, None, "the class has no value of this name", known, name)]

    def start(self, name: str) -> float | None:
        """Returns the value in the attribute `parameters` of the class."""
        return self.source.parameters.get(name)

    def _among(
        self, key: str, name: str, known: tuple[str, ...] | None, attribute: str
    ) -> list[str]:
        if known is None or name in known:
            return []
        why = f"the attribute '{attribute}' of the class does not have this name"
        return [_no_name(key, name, why, known, attribute)]


def _article(causality: str) -> str:
    words = {"local": "inner variable", "calculatedParameter": "calculated value"}
    word = words.get(causality, causality)
    return f"an {word}" if word[0] in "aeiou" else f"a {word}"


def _listed(names: Iterable[str]) -> str:
    names = list(names)
    if not names:
        return "; it has none"
    more = "..." if len(names) > MOST_NAMES else ""
    return f", one of {', '.join(names[:MOST_NAMES])}{more}"


def _no_name(key: str, name: str | None, why: str, known: Iterable[str], wanted: str) -> str:
    """Returns the problem of an unknown name, given as the value of a key or as the key itself."""
    known = list(known)
    nearest = nearest_name(wanted if name is None else name, known)
    stated = f"'{key}'" if name is None else f"'{key}' = {value_text(name)}"
    if nearest is not None:
        return f"{stated}: {why}; did you mean '{nearest}'?"
    return f"{stated}: {why}: expected{_listed(known).replace(',', '', 1)}"


def program_of_fmu(text: str, path: Path, problems: list[str]) -> Program:
    """Returns an FMU with its names; appends the problem if it cannot be used here."""
    try:
        description = read_description(path)
    except FmuError as error:
        problems.append(f"'simulator.fmu' = {value_text(text)}: {error}")
        return Program()
    if not description.runs_here:
        has = ", ".join(description.platforms) or "none; it may have sources only"
        here = platform_names()[description.major]
        problems.append(
            f"'simulator.fmu' = {value_text(text)}: has no library for this platform, {here}: its "
            f"platforms are: {has}; export it for this platform"
        )
    return FmuProgram(description)


def program_of_python(text: str, base: Path, problems: list[str]) -> Program:
    """Returns a class or function with its names; appends the problem if it cannot be one."""
    place = read_place(text)
    if place is None:
        problems.append(
            f"'simulator.python' = {value_text(text)}: expected FILE.py:NAME, or MODULE:NAME for "
            "an installed module"
        )
        return Program()
    if not place.is_file:
        return Program()
    try:
        source = read_source(Path(os.path.normpath(base / place.where)), place.name)
    except SourceError as error:
        problems.append(f"'simulator.python' = {value_text(text)}: {error}")
        return Program()
    return PythonProgram(source) if source.is_class else Program()
