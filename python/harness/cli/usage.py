# SPDX-License-Identifier: MIT
"""Messages for options and arguments that the library of the command line refuses.

The words of typer and click differ between their versions, and do not repeat what the user has
typed. These messages do, and say what was expected.

The help of a command, made of the docstring of its function.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
import types
import typing
from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any

import typer

# The base of all errors of the command line. click has it, but typer may bring its own click.
UsageError: type[Exception] = typer.BadParameter.__mro__[1]
WORDS: dict[type, str] = {int: "a whole number", float: "a number"}


def usage_message(
    error: Exception, function: Callable[..., Any], arguments: Sequence[str], called: str
) -> str:
    """Returns the message for an error of the command line.

    Parameters
    ----------
    error
        error of the library, a `UsageError`.
    function
        function of the command; the types of its parameters say what is expected.
    arguments
        arguments that the user has typed.
    called
        the command as the user calls it, such as "ehsid estimate".
    """
    return f"{_problem(error, function, arguments)}; `{called} --help` lists what there is"


def _problem(error: Any, function: Callable[..., Any], arguments: Sequence[str]) -> str:
    parameter = getattr(error, "param", None)
    match type(error).__name__:
        case "NoSuchOption":
            # Imported here, because it loads numpy, which `ehsid --help` does not need.
            from ..records.errors import nearest_name

            nearest = nearest_name(error.option_name, _options(error))
            hint = f"; did you mean {nearest}?" if nearest else ""
            return f"{error.option_name}: there is no such option{hint}"
        case "BadOptionUsage":
            return f"{error.option_name}: expected a value behind it"
        case "MissingParameter" if parameter is not None:
            named = _named(parameter, function)
            return f"{named} is missing: expected {_expected(function, parameter.name) or named}"
        case "BadParameter" if parameter is not None:
            expected = _expected(function, parameter.name)
            if expected:
                typed = _typed(parameter, arguments)
                named = " ".join(filter(None, [_named(parameter, function), typed]))
                return f"{named}: expected {expected}{_hint(function, parameter.name, typed)}"
    return str(error.format_message()).strip().rstrip(".")


def _hint(function: Callable[..., Any], name: str, typed: str) -> str:
    """The word of a choice that is nearest to what was typed, as a question."""
    kind, _ = _declared(function, name)
    if not (isinstance(kind, type) and issubclass(kind, Enum)):
        return ""
    from ..records.errors import nearest_name

    nearest = nearest_name(typed, [str(member.value) for member in kind])
    return f"; did you mean '{nearest}'?" if nearest else ""


def _options(error: Any) -> list[str]:
    """The options of the command that the error is of."""
    there = error.ctx.command.params if error.ctx is not None else []
    return [name for parameter in there for name in parameter.opts if name.startswith("--")]


def _named(parameter: Any, function: Callable[..., Any]) -> str:
    """The name of an option, or of an argument as the help shows it."""
    if parameter.param_type_name == "option":
        return str(max(parameter.opts, key=len))
    info = _declared(function, parameter.name)[1]
    return str(getattr(info, "metavar", None) or parameter.name.upper()).removesuffix("...")


def _typed(parameter: Any, arguments: Sequence[str]) -> str:
    """The last value that the user has given to an option; "" if it cannot be found."""
    value = ""
    for i, argument in enumerate(arguments):
        name, equals, rest = argument.partition("=")
        if name in parameter.opts:
            value = rest if equals else (arguments[i + 1] if i + 1 < len(arguments) else "")
    return value


def _expected(function: Callable[..., Any], name: str) -> str:
    """What a parameter takes, in words; "" for a type without words."""
    kind, info = _declared(function, name)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return f"one of {', '.join(str(member.value) for member in kind)}"
    words = WORDS.get(kind, "")
    low, high = getattr(info, "min", None), getattr(info, "max", None)
    if words and low is not None:
        words += f" from {low} to {high}" if high is not None else f" of at least {low}"
    return words or str(getattr(info, "help", "") or "").strip()


def _declared(function: Callable[..., Any], name: str) -> tuple[Any, Any]:
    """The type of a parameter, without None and list, and its declaration as an option."""
    kind = typing.get_type_hints(function, include_extras=True).get(name)
    info = next(iter(getattr(kind, "__metadata__", ())), None)
    kind = getattr(kind, "__origin__", kind) if info is not None else kind
    while typing.get_origin(kind) in (types.UnionType, typing.Union, list):
        kind = next(one for one in typing.get_args(kind) if one is not type(None))
    return kind, info


EXAMPLE = "ehsid "
HEADINGS = ("Example: ", "Examples: ")
WIDTH = 74  # of an example; a terminal has 80 columns


def help_text(function: Callable[..., Any]) -> str:
    """Returns the docstring as a terminal shows it: paragraphs of one line, examples at the end.

    A terminal breaks the lines itself, where it is narrow. An example stands on a line of its own,
    to be copied; in the docstring it is a paragraph that begins with "ehsid", and the first one has
    "Example:" or "Examples:" in front.
    """
    examples: list[str] = []
    others: list[str] = []
    for paragraph in (inspect.getdoc(function) or _written(function)).split("\n\n"):
        text = " ".join(paragraph.split())
        for heading in HEADINGS:
            text = text.removeprefix(heading)
        (examples if text.startswith(EXAMPLE) else others).append(text)
    return "\n\n".join([*others, examples_text(examples)])


def _written(function: Callable[..., Any]) -> str:
    """Returns the docstring as the source has it: with PYTHONOPTIMIZE=2 Python drops it."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except OSError:  # there is no source beside the compiled file
        return ""
    (defined,) = tree.body
    return ast.get_docstring(defined) or "" if isinstance(defined, ast.FunctionDef) else ""


def examples_text(examples: Sequence[str]) -> str:
    """Returns examples below a heading, with the breaks of a shell where one is long."""
    heading = "Examples:" if len(examples) > 1 else "Example:"
    return "\n".join([heading, *map(_broken, examples)])


def _broken(example: str) -> str:
    """Breaks an example before an option, so that no line is wider than a terminal."""
    lines = [""]
    for words in re.split(r" (?=--)", example):
        longer = f"{lines[-1]} {words}" if lines[-1] else words
        if len(longer) <= WIDTH or not lines[-1]:
            lines[-1] = longer
        else:
            lines[-1] += " \\"
            lines.append(f"    {words}")
    return "\n".join(lines)
