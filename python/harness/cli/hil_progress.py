# SPDX-License-Identifier: MIT
"""Shows a run on the target while it goes on: a bar on a terminal, plain lines in a log."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

import ehsid
from ehsid.harness.cli.console import Console, PlainColumn
from ehsid.harness.deploy.hil.answers import Result
from ehsid.harness.deploy.hil.session import Counters

LINE_EVERY_S = 10.0
BAR_EVERY_S = 0.1


def state_text(rate: float, result: Result, counters: Counters) -> str:
    """Returns sample rate, fit, lambda, status, and the errors on the line so far, as text."""
    text = (
        f"{rate:.0f}/s, fit {result.fit_percent:.1f} %, lambda {result.forgetting_factor:.4f}, "
        f"{ehsid.Status(result.status).name}"
    )
    troubles = {
        "sent again": counters.asked_again,
        "damaged": counters.bad_frames,
        "late": counters.late,
        "watchdog": counters.resumed,
    }
    return text + "".join(f", {name} {count}" for name, count in troubles.items() if count)


@contextmanager
def live(
    console: Console,
) -> Iterator[Callable[[str, int], Callable[[int, Result, Counters], None]]]:
    """Yields a function that opens a stage with a number of samples.

    That function returns another one, which the caller calls after each sample.
    """
    bar = Progress(
        PlainColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        PlainColumn("{task.fields[state]}"),
        TimeRemainingColumn(compact=True),
        console=console,
        transient=True,
    )

    def stage(name: str, samples: int) -> Callable[[int, Result, Counters], None]:
        began = time.monotonic()
        last = began
        task = bar.add_task(name, total=samples, state="") if console.is_terminal else None

        def update(done: int, result: Result, counters: Counters) -> None:
            nonlocal last
            now = time.monotonic()
            if now - last < (LINE_EVERY_S if task is None else BAR_EVERY_S) and done < samples:
                return
            last = now
            rate = done / max(now - began, 1e-9)
            state = state_text(rate, result, counters)
            if task is not None:
                bar.update(task, completed=done, state=state)
            else:
                left = (samples - done) / rate
                console.print(
                    f"{name}: {done} of {samples}, {left:.0f} s left, {state}",
                    soft_wrap=True,
                )

        return update

    if console.is_terminal:
        with bar:
            yield stage
    else:
        yield stage
