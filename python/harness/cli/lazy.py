# SPDX-License-Identifier: MIT
"""Imports a command only when it is called, so that `ehsid --help` answers at once."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from ehsid.harness.cli.common import refuse


@dataclass(frozen=True)
class Verb:
    """Entry of the overview for a command whose module is not imported yet.

    The command `gap-check` is the function `gap_check_command` of `ehsid.harness.cli.gap_check`.

    Attributes
    ----------
    name
        name that the user types.
    summary
        first line of the docstring of the function; a test compares the two.
    command_class
        class of the command.
    """

    name: str
    summary: str
    command_class: type[TyperCommand] = TyperCommand

    def load(self) -> Any:
        """Imports the module and makes the command."""
        stem = self.name.replace("-", "_")
        module = importlib.import_module(f"ehsid.harness.cli.{stem}")
        app = typer.Typer(add_completion=False)
        function = errors_as_messages(getattr(module, f"{stem}_command"))
        app.command(self.name, cls=self.command_class)(function)
        return typer.main.get_command(app)


def errors_as_messages(function: Callable[..., None]) -> Callable[..., None]:
    """Wraps the function of a command so that bad input ends in one message and exit code 2.

    There is no traceback. The errors of records, rigs, identification and simulation are all
    ValueErrors.
    """

    @functools.wraps(function)
    def guarded(*arguments: Any, **options: Any) -> None:
        try:
            function(*arguments, **options)
        except BrokenPipeError:  # From `ehsid ... | head`; typer then ends without a message.
            raise
        except (ValueError, OSError) as error:
            refuse(str(error))

    return guarded


# The contexts and commands of click have the type `Any` here, because some versions of typer bring
# their own click under another name.
class DeferredCommand(TyperCommand):
    """Takes the place of a command until its arguments are parsed."""

    def __init__(self, verb: Verb) -> None:
        super().__init__(verb.name, help=verb.summary)
        self.verb = verb

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Returns the context of the actual command, which then runs in place of this one."""
        return self.verb.load().make_context(info_name, args, parent, **extra)


def lazy_group(verbs: Iterable[Verb]) -> type[TyperGroup]:
    """Returns a class for `typer.Typer(cls=...)`: the group of these commands, in this order."""

    class LazyGroup(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings)
            for verb in verbs:
                self.add_command(DeferredCommand(verb))

    return LazyGroup
