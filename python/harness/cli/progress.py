# SPDX-License-Identifier: MIT
"""Progress of long work: a bar on a terminal, plain lines in a log, nothing for what is quick."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress

QUICK_S = 2.0
LINE_EVERY_S = 10.0


@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    """Gives a function that is told the share that is done, 0 to 1. Writes to stderr."""
    console = Console(stderr=True)
    began = time.monotonic()
    bar: Progress | None = None
    task = None
    last_line = began

    def report(share: float) -> None:
        nonlocal bar, task, last_line
        now = time.monotonic()
        if now - began < QUICK_S:
            return
        if console.is_terminal:
            if bar is None:
                bar = Progress(console=console, transient=True)
                task = bar.add_task(what, total=1.0)
                bar.start()
            assert task is not None
            bar.update(task, completed=share)
        elif now - last_line >= LINE_EVERY_S:
            last_line = now
            left = (now - began) * (1.0 - share) / share if share > 0.0 else float("nan")
            console.print(f"{what}: {100.0 * share:.0f} %, {left:.0f} s left")

    try:
        yield report
    finally:
        if bar is not None:
            bar.stop()
