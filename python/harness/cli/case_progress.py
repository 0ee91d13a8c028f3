# SPDX-License-Identifier: MIT
"""Shows the progress of work that is done case by case: finished case, outcome, time left."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn

from ehsid.harness.cli.console import Console, PlainColumn
from ehsid.harness.validation.jobs import Outcome


def in_words(seconds: float) -> str:
    """Returns a time in words, such as "40 s", "12 min" or "3 h 20 min"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"


def shown(
    outcomes: Iterable[Outcome], todo: int, total: int, console: Console | None = None
) -> Iterator[Outcome]:
    """Passes the outcomes on and shows each on stderr: a bar on a terminal, lines in a log.

    Parameters
    ----------
    todo, total
        number of outcomes to come, and number of all cases with those of earlier runs.
    """
    console = console or Console(stderr=True)
    began, done = time.monotonic(), total - todo
    bar = Progress(
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        PlainColumn("{task.description}"),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    )
    with bar:
        task = bar.add_task("", total=total, completed=done)
        for i, outcome in enumerate(outcomes, 1):
            if outcome.said:
                console.print(outcome.said.rstrip("\n"), soft_wrap=True)
            rest = todo - i
            left = in_words((time.monotonic() - began) / i * rest)
            line = f"{outcome.name}: {outcome.word.rstrip('.')}, {in_words(outcome.seconds)}"
            if not console.is_terminal or outcome.failed:
                tail = f"; {left} left" if rest else ""
                console.print(f"{done + i} of {total}, {line}{tail}", soft_wrap=True)
            bar.update(task, completed=done + i, description=f"{left} left; {line}")
            yield outcome
