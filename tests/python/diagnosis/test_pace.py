# SPDX-License-Identifier: MIT
"""The share of the expected time never falls, and follows what is known when a stage begins."""

from __future__ import annotations

from typing import Any

from ehsid.harness.diagnosis.job import Known, Pace


def told(*calls: Any, may_be_joint: bool = False) -> list[float]:
    """The shares for calls of `begin` (tuples) and `within` (numbers)."""
    shares: list[float] = []
    pace = Pace(shares.append, may_be_joint=may_be_joint)
    for call in calls:
        if isinstance(call, tuple):
            pace.begin(call[0], Known(*call[1:]))
        else:
            pace.within(call)
    return shares


def test_it_never_falls_whatever_comes() -> None:
    shares = told(
        ("values", 5.0, 5.0),
        ("alone", 2.0, 2.0),
        *(0.25, 0.5, 1.0),
        ("at length", 2.0, 0.05, False, 6),
        ("together", 2.0, 1.5, False, 2),
        *(0.5, 0.9),
        ("together", 4.0, 1.5, True, 1),
        ("deciding", 4.0, 2.5, True),
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
    healthy = told(("values", 1.0, 1.0), ("alone", 0.1, 0.1), 0.5, 1.0)[-1]
    hard = told(("values", 5.0, 5.0), ("alone", 5.0, 5.0), 0.5, 1.0)[-1]
    assert healthy > 0.6
    assert hard < 0.3


SINGLES = [("values", 3.0, 3.0), ("alone", 2.5, 2.5), 1.0]


def end_of(*known: Any, may_be_joint: bool = False) -> float:
    return told(*SINGLES, ("at length", *known), 1.0, may_be_joint=may_be_joint)[-1]


def test_a_set_that_explains_all_ends_the_search() -> None:
    assert end_of(2.5, 0.02, False, 5) > 0.55
    assert end_of(2.5, 1.0, False, 5) < 0.45


def test_an_effect_that_gains_nothing_is_not_extended() -> None:
    assert end_of(1.0, 0.98, False, 5) > end_of(1.0, 0.6, False, 5)


def test_held_out_data_that_show_something_else_are_a_second_search() -> None:
    apart, alike = (2.5, 0.9, True, 3), (2.5, 0.9, False, 3)
    assert end_of(*apart, may_be_joint=True) < 0.8 * end_of(*apart)
    assert end_of(*alike, may_be_joint=True) == end_of(*alike)


def test_more_sets_leave_more_to_do() -> None:
    begun = (*SINGLES, ("at length", 2.5, 0.8, False, 4))
    one, two = (told(*begun, ("together", 2.5, 0.8, False, sets), 0.3)[-1] for sets in (1, 2))
    assert two < one


def test_the_design_of_an_experiment_is_counted() -> None:
    begun = (*SINGLES, ("deciding", 2.5, 0.3))
    without = told(*begun, ("where", 2.5, 0.3), 1.0)[-1]
    assert without == 1.0
    shares = told(*begun, ("where", 2.5, 0.3, False, 1), 1.0, ("experiment", 2.5, 0.3), 0.5, 1.0)
    assert shares[-3] < shares[-2] < shares[-1] == 1.0


def test_without_a_listener_nothing_is_told() -> None:
    pace = Pace(None, may_be_joint=False)
    pace.begin("values", Known(1.0, 1.0))
    pace.within(1.0)
