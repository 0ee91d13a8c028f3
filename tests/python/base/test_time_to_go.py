# SPDX-License-Identifier: MIT
"""The time to go only falls, stands still while the work is late, and reads like a time."""

from __future__ import annotations

import numpy as np
import pytest

from ehsid.harness.base.time_to_go import LEAST_LEFT, TimeToGo, in_words


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_even_work_is_told_exactly() -> None:
    clock = Clock()
    to_go = TimeToGo(clock)
    assert to_go.left_s is None
    for share in np.linspace(0.1, 1.0, 10):
        clock.now = 100.0 + 50.0 * share
        to_go.update(share)
        assert to_go.left_s == pytest.approx(50.0 * (1.0 - share), abs=1e-9)
    assert to_go.seconds == pytest.approx(50.0)


def test_it_falls_with_the_clock_between_reports_but_not_to_nothing() -> None:
    clock = Clock()
    to_go = TimeToGo(clock)
    clock.now = 110.0
    to_go.update(0.1)  # 90 s to go
    clock.now = 130.0
    assert to_go.left_s == pytest.approx(70.0)
    clock.now = 1000.0
    assert to_go.left_s == pytest.approx(90.0 * LEAST_LEFT)


def test_it_never_rises_and_stands_still_while_late() -> None:
    rng = np.random.default_rng(1)
    clock = Clock()
    to_go = TimeToGo(clock)
    share, shown = 0.0, []
    for _ in range(300):
        clock.now += float(rng.exponential(2.0))
        share = min(1.0, share + float(rng.exponential(1.0 / 300)) * rng.choice([0.1, 2.0]))
        to_go.update(share)
        shown += [left for left in (to_go.left_s,) if left is not None]
    assert len(shown) > 200
    assert np.all(np.diff(shown) <= 1e-9)
    late = TimeToGo(clock)
    clock.now += 10.0
    late.update(0.5)
    before = late.left_s
    clock.now += 1.0
    late.update(0.5)  # nothing was done
    frozen = late.left_s
    clock.now += 100.0
    late.update(0.51)
    assert before == pytest.approx(10.0)
    assert frozen == pytest.approx(9.0)
    assert late.left_s == frozen


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.4, "0 s"),
        (39.6, "40 s"),
        (89.4, "89 s"),
        (90.0, "2 min"),
        (600.0, "10 min"),
        (5399.0, "1 h 30 min"),
        (7500.0, "2 h 05 min"),
        (12000.0, "3 h 20 min"),
    ],
)
def test_times_in_words(seconds: float, words: str) -> None:
    assert in_words(seconds) == words
