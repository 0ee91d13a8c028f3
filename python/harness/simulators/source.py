# SPDX-License-Identifier: MIT
"""What a Python file says of the simulator in it: read as text, never run."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

MOST_BYTES = 2**24
_PLACE = re.compile(r"(?P<where>.+):(?P<name>[^\W\d]\w*(?:\.[^\W\d]\w*)*)")


class SourceError(ValueError):
    """A Python file that cannot hold a simulator; the message is one line without its path."""


@dataclass(frozen=True)
class Place:
    """Where a class or a function stands: in a file, or in an installed module."""

    where: str
    """Path of a file, as it is stated, or name of a module."""
    name: str

    @property
    def is_file(self) -> bool:
        """Whether it stands in a file."""
        return self.where.endswith(".py")


@dataclass(frozen=True)
class Source:
    """What the text of a class or a function tells, as far as it is written out."""

    is_class: bool | None
    """None where the name stands for something else, such as a result of a call."""
    inputs: tuple[str, ...] | None = None
    outputs: tuple[str, ...] | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    """Values with their defaults."""
    start_arguments: tuple[str, ...] = ()
    """Names of the arguments of `reset`, or of the function."""


def read_place(text: str) -> Place | None:
    """Returns the parts of "FILE.py:NAME" or "MODULE:NAME"; None for another text."""
    match = _PLACE.fullmatch(text)
    if match is None:
        return None
    place = Place(match["where"], match["name"])
    if place.is_file or all(part.isidentifier() for part in place.where.split(".")):
        return place
    return None


def read_source(path: Path, name: str) -> Source:
    """Reads what a Python file says of a class or a function, without running it.

    Raises
    ------
    SourceError
        there is no such file, it is no Python, or nothing in it has this name.
    """
    tree = _tree(path)
    names = _names(tree.body)
    first = name.partition(".")[0]
    found = names.get(first)
    if found is None:
        if any(_is_star(statement) for statement in ast.walk(tree)):
            return Source(None)
        listed = ", ".join(list(names)[:12]) or "none"
        raise SourceError(
            f"nothing in it has the name '{first}': expected a class with reset and step, or a "
            f"function; the names are: {listed}"
        )
    if "." in name:
        return Source(None)
    if isinstance(found, ast.FunctionDef):
        return Source(False, start_arguments=_arguments(found))
    return _of_class(found) if isinstance(found, ast.ClassDef) else Source(None)


def _arguments(function: ast.FunctionDef) -> tuple[str, ...]:
    args = function.args
    return tuple(one.arg for one in (*args.posonlyargs, *args.args, *args.kwonlyargs))


def _tree(path: Path) -> ast.Module:
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise SourceError("there is no such file: expected a Python file; check the path") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise SourceError(f"cannot be read ({reason}): check the path") from None
    if len(text) > MOST_BYTES:
        raise SourceError(f"has more than {MOST_BYTES} bytes: expected a Python file")
    try:
        return ast.parse(text)
    except SyntaxError as error:
        raise SourceError(f"line {error.lineno or 1}: {error.msg}: expected Python") from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise SourceError(f"cannot be read as Python ({error})") from None


def _names(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    """Returns what defines each name of the module; also below `if` and `try`."""
    found: dict[str, ast.stmt] = {}
    for statement in body:
        if isinstance(statement, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            found[statement.name] = statement
        elif isinstance(statement, ast.Import | ast.ImportFrom):
            for alias in statement.names:
                found[(alias.asname or alias.name).partition(".")[0]] = statement
        else:
            for inner in ("body", "orelse", "finalbody"):
                found |= _names(getattr(statement, inner, []))
            for handler in getattr(statement, "handlers", []):
                found |= _names(handler.body)
            found |= dict.fromkeys(_assigned(statement), statement)
    return found


def _assigned(statement: ast.stmt) -> list[str]:
    targets = getattr(statement, "targets", None) or [getattr(statement, "target", None)]
    return [
        node.id
        for target in targets
        if isinstance(target, ast.AST)
        for node in ast.walk(target)
        if isinstance(node, ast.Name)
    ]


def _is_star(statement: ast.AST) -> bool:
    return isinstance(statement, ast.ImportFrom) and any(a.name == "*" for a in statement.names)


def _of_class(found: ast.ClassDef) -> Source:
    written = {
        name: value
        for statement in found.body
        if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None
        for name in _assigned(statement)
        if (value := _literal(statement.value)) is not None
    }
    parameters = written.get("parameters")
    methods = {one.name: one for one in found.body if isinstance(one, ast.FunctionDef)}
    return Source(
        is_class=True,
        inputs=_texts(written.get("inputs")),
        outputs=_texts(written.get("outputs")),
        parameters={
            name: float(value)
            for name, value in (parameters.items() if isinstance(parameters, dict) else ())
            if isinstance(name, str) and isinstance(value, int | float)
        },
        start_arguments=_arguments(methods["reset"]) if "reset" in methods else (),
    )


def _literal(node: ast.expr) -> object:
    """Returns the value of what is written out, also of `dict(a=1.0)`; None for anything else."""
    if isinstance(node, ast.Call):
        if not (isinstance(node.func, ast.Name) and node.func.id == "dict") or node.args:
            return None
        values = {one.arg: _literal(one.value) for one in node.keywords}
        return None if None in values or None in values.values() else values
    try:
        value: object = ast.literal_eval(node)
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return None
    return value


def _texts(value: object) -> tuple[str, ...] | None:
    if not isinstance(value, list | tuple) or not all(isinstance(one, str) for one in value):
        return None
    return tuple(value)
