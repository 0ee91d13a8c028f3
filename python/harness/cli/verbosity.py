# SPDX-License-Identifier: MIT
"""How much a command says on stderr: -v adds what it does, -q leaves only errors.

Both are options of every command, and may also stand before its name.
"""

from __future__ import annotations

import functools
import inspect
import logging
import sys
import typing
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated, Any

import typer

from ..base.text import printable
from .console import set_quiet

Verbose = Annotated[
    bool,
    typer.Option("--verbose", "-v", help="say on stderr what is done, with times"),
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="nothing on stderr but errors: no progress and no notes"),
]
LOGGER = logging.getLogger("ehsid")


class _Lines(logging.Handler):
    """Writes each message as a line on stderr, with the seconds since the command began."""

    def emit(self, record: logging.LogRecord) -> None:
        text = printable(record.getMessage())
        with suppress(OSError):  # a full disk behind stderr does not end the work
            sys.stderr.write(f"ehsid {record.relativeCreated / 1e3:7.1f} s: {text}\n")
            sys.stderr.flush()


def set_verbosity(*, verbose: bool, quiet: bool) -> None:
    """Sets what is said on stderr from now on.

    Raises
    ------
    ValueError
        both are asked for.
    """
    if verbose and quiet:
        raise ValueError("--verbose and --quiet: expected one of them; leave one out")
    set_quiet(quiet=quiet)
    for handler in [one for one in LOGGER.handlers if isinstance(one, _Lines)]:
        LOGGER.removeHandler(handler)
    if verbose:
        LOGGER.addHandler(_Lines())
    LOGGER.setLevel(logging.INFO if verbose else logging.WARNING)


def with_verbosity(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns the function of a command with the options -v and -q, which it need not know."""

    @functools.wraps(function)
    def run(ctx: typer.Context, *args: Any, verbose: bool, quiet: bool, **named: Any) -> Any:
        before = ctx.obj or {}  # what stood before the name of the command
        set_verbosity(
            verbose=verbose or before.get("verbose", False),
            quiet=quiet or before.get("quiet", False),
        )
        return function(*args, **named)

    types = typing.get_type_hints(function, include_extras=True)
    own = inspect.signature(function).parameters.values()
    added = {"verbose": Verbose, "quiet": Quiet}
    parameters = [
        inspect.Parameter("ctx", inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=typer.Context),
        *(
            one.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=types[one.name])
            for one in own
        ),
        *(
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=annotation
            )
            for name, annotation in added.items()
        ),
    ]
    # Typer reads the options of a command off its signature.
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {**types, **added, "ctx": typer.Context}
    return run
