# SPDX-License-Identifier: MIT
"""Options that take all values up to the next option, such as `--validate a.csv b.csv`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from typer.core import TyperCommand

MANY = ("--validate", "--exclude-effect", "--features")


class ManyValues(TyperCommand):
    """A command whose options `MANY` take several values; options of typer itself take one."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses the arguments after the option is repeated before each of its values."""
        return super().parse_args(ctx, repeated(args))


def repeated(arguments: Sequence[str]) -> list[str]:
    """Repeats each option of `MANY` before each of its values.

    "--validate a b" becomes "--validate a --validate b".
    """
    made: list[str] = []
    option, has_value = "", False
    for position, argument in enumerate(arguments):
        if argument == "--":
            return [*made, *arguments[position:]]
        if argument.startswith("-"):
            name, equals, _ = argument.partition("=")
            option, has_value = (name if name in MANY else ""), bool(equals)
        elif option:
            made += [option] if has_value else []
            has_value = True
        made.append(argument)
    return made
