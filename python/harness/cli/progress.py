# SPDX-License-Identifier: MIT
"""Shows the progress of long work, as a whole or case by case."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TaskProgressColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from ..base.time_to_go import TimeToGo, in_words
from .console import Console, PlainColumn

if TYPE_CHECKING:
    from ..diagnosis.job import Outcome

QUICK_S = 2.0
LINE_EVERY_S = 10.0
LEAST_SHOWN_S = 0.5


class LeftColumn(ProgressColumn):
    """The time to go of a task, as its field `to_go` tells it at this moment."""

    max_refresh = 0.5

    def render(self, task: Any) -> Text:
        """Returns the time in words; nothing where the task is finished."""
        return Text("" if task.finished else left_words(task.fields["to_go"]))


def left_words(to_go: TimeToGo) -> str:
    """Returns the time to go in words; "" while it cannot be told, and at the end."""
    left = to_go.left_s
    return "" if left is None or left < LEAST_SHOWN_S else f"about {in_words(left)} to go"


class Shown:
    """Display of work; call it with the share that is done, 0 to 1."""

    def __init__(self, what: str, console: Console, bar: Progress) -> None:
        self._what = what
        self._stage = ""
        self._console = console
        self._bar = bar
        self._task: TaskID | None = None
        self._share = 0.0
        self._to_go = TimeToGo()
        self._last_line_s = 0.0
        self._line_is_due = False

    def __call__(self, share: float) -> None:
        """Takes the share that is done."""
        self._share = share
        self._to_go.update(share)
        self._show()

    def stage(self, words: str) -> None:
        """Takes what is done now, in words."""
        self._stage = words
        self._line_is_due = True
        self._show()

    def note(self, sentence: str) -> None:
        """Prints a sentence above the bar."""
        self._console.print(sentence, soft_wrap=True)

    def _show(self) -> None:
        if self._to_go.seconds < QUICK_S and self._task is None:
            return
        if self._console.is_terminal:
            text = f"{self._what}: {self._stage}" if self._stage else self._what
            if self._task is None:
                self._bar.start()
                self._task = self._bar.add_task(text, total=1.0, to_go=self._to_go)
            self._bar.update(self._task, completed=self._share, description=text)
            return
        now = self._to_go.seconds
        if self._line_is_due or (now - self._last_line_s >= LINE_EVERY_S and self._share > 0.0):
            self._line_is_due, self._last_line_s = False, now
            left = left_words(self._to_go)
            parts = [f"{100.0 * self._share:.0f} %", *([left] if left else [])]
            stage = f"; {self._stage}" if self._stage else ""
            self._console.print(f"{self._what}: {', '.join(parts)}{stage}", soft_wrap=True)


@contextmanager
def stages() -> Iterator[Callable[[str, float], None]]:
    """Yields a function that shows progress on stderr.

    The caller passes the name of a part of the work and the share of it that is done, 0 to 1.
    """
    with _bar() as (console, bar):
        shown: dict[str, Shown] = {}

        def report(what: str, share: float) -> None:
            if what not in shown:
                shown[what] = Shown(what, console, bar)
            shown[what](share)

        yield report


@contextmanager
def progress_of(what: str) -> Iterator[Shown]:
    """Yields the display of work on stderr."""
    with _bar() as (console, bar):
        yield Shown(what, console, bar)


@contextmanager
def _bar() -> Iterator[tuple[Console, Progress]]:
    """Yields a console and a bar on it, which ends with the block."""
    console = Console(stderr=True)
    columns = (
        PlainColumn("{task.description}"),
        BarColumn(bar_width=20),
        TaskProgressColumn(),
        LeftColumn(),
    )
    bar = Progress(*columns, console=console, transient=True)
    try:
        yield console, bar
    finally:
        if bar.tasks:  # elsewhere than on a terminal, rich ends every bar with an empty line
            bar.stop()


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
            left = "" if to_go.left_s is None else f"{in_words(to_go.left_s)} left; "
            line = f"{outcome.name}: {outcome.word.rstrip('.')}, {in_words(outcome.seconds)}"
            if not console.is_terminal or outcome.failed:
                tail = f"; {left.removesuffix('; ')}" if rest and left else ""
                console.print(f"{done + i} of {total}, {line}{tail}", soft_wrap=True)
            bar.update(task, completed=done + i, description=f"{left}{line}")
            yield outcome
