# SPDX-License-Identifier: MIT
"""The option --fail-on: a verdict that makes the command end with exit code 3, for CI."""

from __future__ import annotations

import typing
from collections.abc import Sequence
from typing import Annotated

import typer

from .completing import verdicts

EXIT_CODE = 3
ANY = "any"

FailOn = Annotated[
    str | None,
    typer.Option(
        metavar="VERDICT,...",
        help=f"exit code {EXIT_CODE} if the verdict is one of these, for CI; '{ANY}': each but "
        "no_gap. The results are written all the same",
        show_default=False,
        autocompletion=verdicts,
    ),
]


def failing_verdicts(text: str | None) -> frozenset[str]:
    """Returns the verdicts that an option names.

    Raises
    ------
    ValueError
        one of the words is no verdict.
    """
    if text is None:
        return frozenset()
    from ..diagnosis.schema import Verdict
    from ..records.errors import nearest_name

    known: tuple[str, ...] = typing.get_args(Verdict)
    found: set[str] = set()
    for word in map(str.strip, text.split(",")):
        if word == ANY:
            found.update(verdict for verdict in known if verdict != "no_gap")
        elif word in known:
            found.add(word)
        else:
            nearest = nearest_name(word, [*known, ANY])
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise ValueError(
                f"--fail-on '{word}': expected verdicts with commas between them, of "
                f"{', '.join(known)}, or {ANY}{hint}"
            )
    return frozenset(found)


def fail_if(found: Sequence[str], of: str) -> None:
    """Ends the program with exit code 3 if verdicts were found that must not be.

    Parameters
    ----------
    found
        what was found of the verdicts that the user named, each with its place.
    of
        what `found` has, for the message.
    """
    if found:
        typer.echo(
            f"ehsid: the exit code is {EXIT_CODE}, because --fail-on names {of}: "
            f"{'; '.join(found)}",
            err=True,
        )
        raise typer.Exit(EXIT_CODE)
