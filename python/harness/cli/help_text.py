# SPDX-License-Identifier: MIT
"""The help of a command, made of the docstring of its function."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Sequence
from typing import Any

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
