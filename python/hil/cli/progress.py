# SPDX-License-Identifier: MIT
"""Shows runs on the target while they go on: a bar on a terminal, plain lines in a log.

The time to go is that of all runs together, and never rises.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress

import ehsid
from ehsid.harness.base.time_to_go import TimeToGo
from ehsid.harness.cli.console import Console, PlainColumn
from ehsid.harness.cli.progress import LeftColumn, left_words

from ..answers import Result, SampleAnswer
from ..session import Counters

LINE_EVERY_S = 10.0
BAR_EVERY_S = 0.1

Update = Callable[[int, SampleAnswer, Counters], None]


def state_text(rate: float, result: SampleAnswer, counters: Counters) -> str:
    """Returns sample rate, fit and lambda or K, status, and the errors on the line, as text."""
    if isinstance(result, Result):
        told = f"fit {result.fit_percent:.1f} %, lambda {result.forgetting_factor:.4f}"
    else:
        reason = ehsid.TrustReason(result.velocity_gain_reason).name.replace("_", " ")
        value = result.velocity_gain_m_s_v
        told = f"K: {reason}" if math.isnan(value) else f"K {value:.4g} m/s per V ({reason})"
    text = f"{rate:.0f}/s, {told}, {ehsid.Status(result.status).name}"
    troubles = {
        "sent again": counters.asked_again,
        "damaged": counters.bad_frames,
        "late": counters.late,
        "watchdog": counters.resumed,
    }
    return text + "".join(f", {name} {count}" for name, count in troubles.items() if count)


@contextmanager
def live(
    console: Console, all_samples: int, clock: Callable[[], float] = time.monotonic
) -> Iterator[Callable[[str, int], Update]]:
    """Yields a function that opens a run with a number of samples.

    That function returns another one, which the caller calls after each sample.

    Parameters
    ----------
    console
        where the progress is shown.
    all_samples
        number of samples of all runs together.
    clock
        tells the time in seconds.
    """
    bar = Progress(
        PlainColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        PlainColumn("{task.fields[state]}"),
        LeftColumn(),
        console=console,
        transient=True,
    )
    to_go = TimeToGo(clock)
    opened = 0  # samples of the runs that were opened so far

    def stage(name: str, samples: int) -> Update:
        nonlocal opened
        before, opened = opened, opened + samples
        began = last = clock()
        task = None
        if console.is_terminal:
            task = bar.add_task(name, total=samples, state="", to_go=to_go)

        def update(done: int, result: SampleAnswer, counters: Counters) -> None:
            nonlocal last
            now = clock()
            if now - last < (LINE_EVERY_S if task is None else BAR_EVERY_S) and done < samples:
                return
            last = now
            to_go.update((before + done) / all_samples)
            state = state_text(done / max(now - began, 1e-9), result, counters)
            if task is not None:
                bar.update(task, completed=done, state=state)
                return
            left = left_words(to_go)
            parts = [f"{name}: {done} of {samples}", state, *([left] if left else [])]
            console.print(", ".join(parts), soft_wrap=True)

        return update

    if console.is_terminal:
        with bar:
            yield stage
    else:
        yield stage
