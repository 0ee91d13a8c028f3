# SPDX-License-Identifier: MIT
"""Shows the progress of long work: a bar on a terminal, elsewhere lines of the logger `ehsid`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..base.text import printable
from ..base.time_to_go import TimeToGo, in_words
from .wording import LOGGER

LINE_EVERY_S = 10.0


@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    """Yields a function that takes the share of the work that is done, 0 to 1."""
    what = printable(what)
    with _bar(what) if sys.stderr is not None and sys.stderr.isatty() else _lines(what) as report:
        yield report


@contextmanager
def _bar(what: str) -> Iterator[Callable[[float], None]]:
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    to_go = TimeToGo()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        TaskProgressColumn(),
        TextColumn("{task.fields[left]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(what), total=1.0, left="")

        def report(share: float) -> None:
            to_go.update(share)
            left = to_go.left_s
            words = "" if left is None else f"about {in_words(left)} to go"
            bar.update(task, completed=share, left=words)

        yield report


@contextmanager
def _lines(what: str) -> Iterator[Callable[[float], None]]:
    to_go, last = TimeToGo(), 0.0

    def report(share: float) -> None:
        nonlocal last
        to_go.update(share)
        left = to_go.left_s
        if to_go.seconds - last >= LINE_EVERY_S and left is not None:
            last = to_go.seconds
            LOGGER.info("%s: %.0f %%, about %s to go", what, 100.0 * share, in_words(left))

    LOGGER.info("%s: begins", what)
    yield report
    LOGGER.info("%s: done after %.1f s", what, to_go.seconds)
