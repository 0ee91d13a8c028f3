# SPDX-License-Identifier: MIT
"""Shows the progress of work that is done case by case: finished case, outcome, time left."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn

from ..base.time_to_go import TimeToGo, in_words
from ..diagnosis.job import Outcome
from .console import Console, PlainColumn


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
    to_go, done = TimeToGo(), total - todo
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
            to_go.update(i / todo)
            left = in_words(to_go.left_s or 0.0)
            line = f"{outcome.name}: {outcome.word.rstrip('.')}, {in_words(outcome.seconds)}"
            if not console.is_terminal or outcome.failed:
                tail = f"; {left} left" if rest else ""
                console.print(f"{done + i} of {total}, {line}{tail}", soft_wrap=True)
            bar.update(task, completed=done + i, description=f"{left} left; {line}")
            yield outcome
