# SPDX-License-Identifier: MIT
"""The time to go of long work: it only falls, and stands still while the work is late."""

from __future__ import annotations

import time
from collections.abc import Callable

LEAST_SHARE = 0.02  # of the work, from which the time to go is told
# Between two reports the time to go falls with the clock where the last one was on time, but not
# below this share of what it was: a stage without reports may take longer than was expected.
LEAST_LEFT = 0.4


class TimeToGo:
    """Tells how long work will go on, from the share of it that is done."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begins now; `clock` tells the time in seconds."""
        self._clock = clock
        self._began = self._updated = clock()
        self._left_s: float | None = None
        self._late = False

    @property
    def seconds(self) -> float:
        """Time since the begin, s."""
        return self._clock() - self._began

    def update(self, share: float) -> None:
        """Takes the share of the work that is done, 0 to 1."""
        if share < LEAST_SHARE:
            return
        now = self._clock()
        expected = (now - self._began) * (1.0 - min(share, 1.0)) / share
        shown = self.left_s
        self._late = shown is not None and expected > shown
        self._left_s = shown if shown is not None and self._late else expected
        self._updated = now

    @property
    def left_s(self) -> float | None:
        """Time to go, s; None where it cannot be told yet."""
        if self._left_s is None or self._late:
            return self._left_s
        return max(self._left_s - (self._clock() - self._updated), LEAST_LEFT * self._left_s)


def in_words(seconds: float) -> str:
    """Returns a time in words, such as "40 s", "12 min" or "3 h 20 min"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"
