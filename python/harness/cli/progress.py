# SPDX-License-Identifier: MIT
"""Shows the progress of long work: a bar on a terminal, plain lines in a log.

A stage that takes less than `QUICK_S` seconds shows nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TimeRemainingColumn,
)

from ehsid.harness.cli.console import Console, PlainColumn

QUICK_S = 2.0
LINE_EVERY_S = 10.0


class _Shown:
    """Display of one stage of the work; `update` receives the share in [0, 1] that is done."""

    def __init__(self, what: str, console: Console, bar: Progress) -> None:
        self.what = what
        self.console = console
        self.bar = bar
        self.task: TaskID | None = None
        self.began = self.last_line = time.monotonic()

    def update(self, share: float) -> None:
        now = time.monotonic()
        if now - self.began < QUICK_S and self.task is None:
            return
        if self.console.is_terminal:
            if self.task is None:
                self.bar.start()
                self.task = self.bar.add_task(self.what, total=1.0)
            self.bar.update(self.task, completed=share)
        elif now - self.last_line >= LINE_EVERY_S and share > 0.0:
            self.last_line = now
            left = (now - self.began) * (1.0 - share) / share
            self.console.print(f"{self.what}: {100.0 * share:.0f} %, {left:.0f} s left")


@contextmanager
def stages() -> Iterator[Callable[[str, float], None]]:
    """Yields a function that shows progress on stderr.

    The caller passes the name of a stage and the share of it that is done, 0 to 1.
    """
    console = Console(stderr=True)
    columns = (
        PlainColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
    )
    bar = Progress(*columns, console=console, transient=True)
    shown: dict[str, _Shown] = {}

    def report(what: str, share: float) -> None:
        if what not in shown:
            shown[what] = _Shown(what, console, bar)
        shown[what].update(share)

    try:
        yield report
    finally:
        if bar.tasks:  # elsewhere than on a terminal, rich ends every bar with an empty line
            bar.stop()


@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    """Yields a function that shows the progress of work with a single stage; see `stages`."""
    with stages() as report:
        yield lambda share: report(what, share)
