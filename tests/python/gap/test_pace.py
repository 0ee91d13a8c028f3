# SPDX-License-Identifier: MIT
"""The share of the expected time never falls, and follows what is known when a stage begins."""

from __future__ import annotations

from typing import Any

import pytest

from ehsid.harness.gap.pace import Pace


def told(*calls: Any, may_be_joint: bool = False) -> list[float]:
    """The shares for calls of `begin` (tuples) and `within` (numbers)."""
    shares: list[float] = []
    pace = Pace(shares.append, may_be_joint=may_be_joint)
    for call in calls:
        if isinstance(call, tuple):
            pace.begin(*call)
        else:
            pace.within(call)
    return shares


HEALTHY = [("values", 1.0, 1.0), ("alone", 0.1, 0.1), 0.5, 1.0, ("at length", 0.1, 0.1), 0.5]


def test_it_never_falls_whatever_comes() -> None:
    shares = told(
        ("values", 5.0, 5.0),
        ("alone", 2.0, 2.0),
        *(0.25, 0.5, 1.0),
        ("at length", 2.0, 0.05),
        ("together", 2.0, 1.5),
        *(0.5, 0.9),
        ("together", 4.0, 1.5),
        ("deciding", 4.0, 2.5),
        ("values", 4.0, 4.0),
        ("alone", 4.0, 4.0),
        ("laws", 4.0, 2.0),
        ("where", 4.0, 2.0),
        1.0,
        may_be_joint=True,
    )
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < 0.1
    assert shares[-1] == 1.0


def test_a_rig_that_fits_has_little_behind_the_first_trials() -> None:
    healthy, hard = told(*HEALTHY)[3], told(("values", 5.0, 5.0), ("alone", 5.0, 5.0), 0.5, 1.0)[3]
    assert healthy > 0.6
    assert hard < 0.3


@pytest.mark.parametrize(("best", "later"), [(0.05, True), (1.0, False)])
def test_a_set_that_explains_all_ends_the_search(best: float, later: bool) -> None:
    calls = [("values", 3.0, 3.0), ("alone", 2.5, 2.5), 1.0, ("at length", 2.5, best), 1.0]
    assert (told(*calls)[-1] > 0.55) == later


def test_without_a_listener_nothing_is_told() -> None:
    pace = Pace(None, may_be_joint=False)
    pace.begin("values", 1.0, 1.0)
    pace.within(1.0)
