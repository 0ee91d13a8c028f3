# SPDX-License-Identifier: MIT
"""The options of a diagnosis on the command line, of every command that diagnoses."""

from __future__ import annotations

import functools
import inspect
import typing
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .completing import effect_ids

if TYPE_CHECKING:
    from ..diagnosis.options import DiagnosisOptions

ExcludedEffects = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ID...",
        help="effects of the catalogue to leave out",
        autocompletion=effect_ids,
    ),
]


def diagnosis_options(exclude_effect: ExcludedEffects = None) -> DiagnosisOptions:
    """Returns what these options say; each argument is an option of the commands.

    Raises
    ------
    ValueError
        an option cannot be used.
    """
    from ..diagnosis.options import DiagnosisOptions

    return DiagnosisOptions(exclude_effect or ())


def with_diagnosis_options(command: Callable[..., None]) -> Callable[..., None]:
    """Returns a command with the options of a diagnosis, which it gets as the value `options`."""
    chosen = inspect.signature(diagnosis_options).parameters

    @functools.wraps(command)
    def run(**given: Any) -> None:
        options = diagnosis_options(**{name: given.pop(name) for name in chosen})
        command(**given, options=options)

    types = typing.get_type_hints(diagnosis_options, localns=_LATER, include_extras=True)
    types |= typing.get_type_hints(command, localns=_LATER, include_extras=True)
    parameters: list[inspect.Parameter] = []
    for one in inspect.signature(command).parameters.values():
        parameters += chosen.values() if one.name == "options" else [one]
    # Typer reads the options of a command off its signature.
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: types[one.name] for one in parameters}
    return run


# The type is imported only where a command runs: --help shall be fast.
_LATER = {"DiagnosisOptions": object}
