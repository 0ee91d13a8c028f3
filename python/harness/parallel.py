# SPDX-License-Identifier: MIT
"""Independent tasks on all cores, with progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import joblib

T = TypeVar("T")
Progress = Callable[[float], None]


def run_tasks(tasks: Sequence[Callable[[], T]], progress: Progress | None = None) -> list[T]:
    """Results in the order of the tasks; each must be picklable.

    progress is called with the share that is done, 0 to 1.
    """
    results: list[T] = []
    running = joblib.Parallel(n_jobs=-1, return_as="generator")(
        joblib.delayed(task)() for task in tasks
    )
    for result in running:
        results.append(result)
        if progress is not None:
            progress(len(results) / len(tasks))
    return results
