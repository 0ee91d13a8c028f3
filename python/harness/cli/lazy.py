# SPDX-License-Identifier: MIT
"""Imports a command only when it is called, so that `ehsid --help` answers at once.

Values that a shell completes, beside the commands, options and choices that typer knows.
"""

from __future__ import annotations

import importlib
import importlib.util
import logging
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from importlib.metadata import entry_points
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from ..base.error_words import error_words, fault_words, install_line, printable
from .console import LOGGER, refuse, with_verbosity
from .usage import UsageError, examples_text, help_text, usage_message


@dataclass(frozen=True)
class Verb:
    """Entry of the overview for a command whose module is not imported yet.

    The command `gap-fleet` is the function `gap_fleet_command` of `ehsid.harness.cli.gap_fleet`,
    and `rig new` is `rig_new_command` of `ehsid.harness.cli.rig_new`.
    """

    name: str
    """Name that the user types; with a space, the name of a group of commands is in front."""
    summary: str
    """First line of the docstring of the function; a test compares the two."""
    command_class: type[TyperCommand] = TyperCommand
    """Class of the command."""
    package: str = "ehsid.harness.cli"
    """Package of its module."""
    needs: str = ""
    """Module of another project that it cannot work without, or "" where it has all it needs."""
    extra: str = ""
    """Extra of ehsid that installs what it needs."""

    @property
    def stem(self) -> str:
        """Name of the module, and of the function without its ending."""
        return self.name.replace("-", "_").replace(" ", "_")

    @property
    def module(self) -> str:
        """Full name of its module."""
        return f"{self.package}.{self.stem}"

    @property
    def last_name(self) -> str:
        """Name inside its group."""
        return self.name.split()[-1]

    def function(self) -> Callable[..., Any]:
        """Imports the module and returns the function of the command."""
        module = importlib.import_module(self.module)
        function: Callable[..., Any] = getattr(module, f"{self.stem}_command")
        return function

    def load(self) -> Any:
        """Imports the module and makes the command."""
        app = typer.Typer(add_completion=False)
        function = self.function()
        decorate = app.command(self.last_name, cls=self.command_class, help=help_text(function))
        decorate(errors_as_messages()(with_verbosity(self._where_installed(function))))
        return typer.main.get_command(app)

    def _where_installed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Returns the function with a check in front: its help is there without what it needs."""

        @wraps(function)
        def checked(*arguments: Any, **options: Any) -> Any:
            if self.needs and importlib.util.find_spec(self.needs) is None:
                refuse(
                    f"'ehsid {self.name}' needs the package '{self.needs}', which is not "
                    f"installed; install it with: {install_line(self.extra)}"
                )
            return function(*arguments, **options)

        return checked


def verbs_of_guests() -> tuple[Verb, ...]:
    """Returns the verbs that packages outside of the product offer.

    Each names its tuple of verbs as an entry point of the group `ehsid.verbs`.
    """
    offers = sorted(entry_points(group="ehsid.verbs"), key=lambda offer: offer.name)
    return tuple(verb for offer in offers for verb in offer.load())


@contextmanager
def errors_as_messages() -> Iterator[None]:
    """Makes bad input end in one message and exit code 2, and Ctrl-C in one line and 130.

    A fault of the program ends in one line and 1; only -v adds the traceback.
    """
    try:
        yield
    except BrokenPipeError:  # From `ehsid ... | head`; typer then ends without a message.
        raise
    except KeyboardInterrupt:
        typer.echo("ehsid: interrupted", err=True)
        raise typer.Exit(130) from None
    except Exception as error:
        if type(error).__module__.partition(".")[0] in ("click", "typer"):
            raise
        words = error_words(error)
        if words is None:
            if LOGGER.isEnabledFor(logging.INFO):
                traceback.print_exception(error)
            typer.echo(f"ehsid: {printable(fault_words(error))}", err=True)
            raise typer.Exit(1) from None
        refuse(words)


# The contexts and commands of click have the type `Any` here, because some versions of typer bring
# their own click under another name.
class DeferredCommand(TyperCommand):
    """Takes the place of a command until its arguments are parsed."""

    def __init__(self, verb: Verb) -> None:
        super().__init__(verb.last_name, help=verb.summary)
        self.verb = verb

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Returns the context of the actual command, which then runs in place of this one."""
        given = list(args)  # the library takes its arguments out of the list
        with errors_as_messages():
            try:
                return self.verb.load().make_context(info_name, args, parent, **extra)
            except UsageError as error:
                called = f"ehsid {self.verb.name}"
                refuse(usage_message(error, self.verb.function(), given, called))


def lazy_group(
    verbs: Sequence[Verb], groups: Mapping[str, str], examples: Mapping[str, Sequence[str]]
) -> type[TyperGroup]:
    """Returns a class for `typer.Typer(cls=...)`: the group of these commands, in this order.

    Parameters
    ----------
    verbs
        commands; those with a space in their names are in a group inside this group.
    groups
        summaries of these inner groups, by name.
    examples
        examples of these inner groups, by name.
    """

    class LazyGroup(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings)
            for verb in verbs:
                name, _, inside = verb.name.partition(" ")
                if not inside:
                    self.add_command(DeferredCommand(verb))
                elif name not in self.commands:
                    inner = [one for one in verbs if one.name.startswith(f"{name} ")]
                    help_of_group = f"{groups[name]}\n\n{examples_text(examples[name])}"
                    self.add_command(inner_group(name, help_of_group, inner))

        def make_context(
            self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
        ) -> Any:
            """Returns the context; a misspelt option becomes a message with the nearest one."""
            try:
                return super().make_context(info_name, args, parent, **extra)
            except UsageError as error:
                if type(error).__name__ != "NoSuchOption":
                    raise
                called = "ehsid" if parent is None else f"ehsid {info_name}"
                refuse(usage_message(error, _no_function, args, called))

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            """Returns the command that the first argument names."""
            if args and args[0] not in self.commands and not args[0].startswith("-"):
                from ..records.errors import nearest_name

                nearest = nearest_name(args[0], self.commands)
                hint = f"did you mean '{nearest}'? There are" if nearest else "expected one of"
                refuse(f"there is no command '{args[0]}'; {hint}: {', '.join(self.commands)}")
            return super().resolve_command(ctx, args)

    return LazyGroup


def _no_function() -> None:
    """Stands for the function of a group, which takes options of typer only."""


def inner_group(name: str, summary: str, verbs: Iterable[Verb]) -> TyperGroup:
    """Returns a group of commands inside the group of all; its verbs are known by their last names.

    Parameters
    ----------
    name, summary
        of the group, for the overview, which shows the first paragraph.
    verbs
        its commands, in their order.
    """
    group = lazy_group((), {}, {})(name=name, help=summary, no_args_is_help=True)
    for verb in verbs:
        group.add_command(DeferredCommand(verb))
    return group


def effect_ids(incomplete: str) -> list[str]:
    """Returns the ids of the catalogue that begin so."""
    from ..catalogue.parameters import effects

    return [effect for effect in effects() if effect.startswith(incomplete)]


def injected_effects(incomplete: str) -> list[str]:
    """Returns the effects that can be injected into a log and begin so."""
    from ..signals.injection.effects import COMMAND, POSITION

    return [effect for effect in (*COMMAND, *POSITION) if effect.startswith(incomplete)]


def effect_sizes(incomplete: str) -> list[str]:
    """Returns EFFECT.PARAMETER= for all parameters of effects that begin so."""
    from ..catalogue.parameters import effects

    named = [f"{info.id}.{one.name}=" for info in effects().values() for one in info.parameters]
    return [name for name in named if name.startswith(incomplete)]


def verdicts(incomplete: str) -> list[str]:
    """Returns the verdicts, the last of several with commas between them."""
    import typing

    from ..diagnosis.schema import Verdict

    before, comma, last = incomplete.rpartition(",")
    words = [*typing.get_args(Verdict), "any"]
    return [f"{before}{comma}{word}" for word in words if word.startswith(last)]
