# SPDX-License-Identifier: MIT
"""Shows the progress of long work: a bar on a terminal, elsewhere lines of the logger `ehsid`."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ehsid.harness.api.wording import LOGGER
from ehsid.harness.text import printable

LINE_EVERY_S = 10.0


@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    """Yields a function that takes the share of the work that is done, 0 to 1."""
    what = printable(what)
    with _bar(what) if sys.stderr.isatty() else _lines(what) as report:
        yield report


@contextmanager
def _bar(what: str) -> Iterator[Callable[[float], None]]:
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(what), total=1.0)
        yield lambda share: bar.update(task, completed=share)


@contextmanager
def _lines(what: str) -> Iterator[Callable[[float], None]]:
    began = last = time.monotonic()

    def report(share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= LINE_EVERY_S and share > 0.0:
            last = now
            left = (now - began) * (1.0 - share) / share
            LOGGER.info("%s: %.0f %%, %.0f s left", what, 100.0 * share, left)

    LOGGER.info("%s: begins", what)
    yield report
    LOGGER.info("%s: done after %.1f s", what, time.monotonic() - began)
