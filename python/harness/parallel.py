# SPDX-License-Identifier: MIT
"""Independent tasks on all cores, with progress."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

import joblib

T = TypeVar("T")
Progress = Callable[[float], None]

_WORKERS: ContextVar[int] = ContextVar("_WORKERS", default=-1)


def worker_count() -> int:
    """That `run_tasks` uses here; -1: one for each core."""
    return _WORKERS.get()


@contextmanager
def workers(count: int | None) -> Iterator[None]:
    """How many processes `run_tasks` uses inside; None: one for each core."""
    token = _WORKERS.set(-1 if count is None else count)
    try:
        yield
    finally:
        _WORKERS.reset(token)


@contextmanager
def _workers_deaf_to_ctrl_c() -> Iterator[None]:
    """Processes that are started meanwhile never see an interrupt from the keyboard.

    Else each of them answers with a traceback of its own; this process ends them. A signal that is
    ignored stays so in a child (POSIX), also while it is still importing. To block it would not do:
    what keeps track of the workers' resources unblocks it when it starts. Only the main thread may
    set what a signal does.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def run_tasks(tasks: Sequence[Callable[[], T]], progress: Progress | None = None) -> list[T]:
    """Results in the order of the tasks; each must be picklable.

    progress is called with the share that is done, 0 to 1.
    """
    results: list[T] = []
    with _workers_deaf_to_ctrl_c():
        running = joblib.Parallel(n_jobs=worker_count(), return_as="generator")(
            joblib.delayed(task)() for task in tasks
        )
    for result in running:
        results.append(result)
        if progress is not None:
            progress(len(results) / len(tasks))
    return results
