# SPDX-License-Identifier: MIT
"""Clocks that are put forward or back, and counters that begin anew, made to run on."""

from __future__ import annotations

import numpy as np

from ...base.arrays import FloatArray
from ..timebase import BRIDGED_STEPS, GAP_FACTOR
from .uniform import Rows

HOUR_S = 3600.0
# Shares of a second in which counters count.
_PARTS = (1.0, 1e-3, 1e-6, 1e-9)
# A register of so many bits begins anew when it is full; no run ends there by chance.
_FULL = tuple(sorted({2.0**bits * part for bits in (16, 24, 31, 32) for part in _PARTS}))
# Minutes, hours, days and powers of ten, at which a run may end as well.
_ROUND = tuple(
    sorted({60.0, 3600.0, 86400.0, 6e4, 3.6e6, 8.64e7} | {10.0**digits for digits in range(1, 13)})
)
# With more returns than this share of the steps it is no counter.
MOST_RETURNS = 0.05


def put_right(time_s: FloatArray, first_row: int) -> tuple[FloatArray, list[str]]:
    """Returns times of a place as they would be without summer time or a clock of 12 hours.

    Such a clock is off by whole hours from one row to the next, beside its usual step.
    """
    remarks: list[str] = []
    made = time_s
    for off_s, least, most, words in (
        (-HOUR_S, 0.0, BRIDGED_STEPS, "the clock was put back by one hour (end of summer time)"),
        (HOUR_S, 0.5, GAP_FACTOR, "the clock was put forward by one hour (summer time began)"),
        (-12 * HOUR_S, 0.0, BRIDGED_STEPS, "the clock has 12 hours and begins anew"),
    ):
        rows = _jumps(made, off_s, least, most)
        if 0 < rows.size <= MOST_RETURNS * time_s.size:
            made = _shifted(made, rows, -off_s)
            remarks.append(
                f"{words} {_where(rows, first_row)}: the times after it are moved to run on"
            )
    return made, remarks


def unwrapped(values: FloatArray, first_row: int) -> tuple[FloatArray, list[str]]:
    """Returns the values of a counter that goes on where it would begin anew.

    A fall to the start of a round number, such as 1000, is taken for that only if the record does
    not begin there too: else it may be a second run behind the first.
    """
    there = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[there])
    falls = np.flatnonzero(steps < 0.0)
    if not 0 < falls.size <= MOST_RETURNS * steps.size or not (steps > 0.0).any():
        return values, []
    usual = float(np.median(steps[steps > 0.0]))
    before, after = values[there[falls]], values[there[falls + 1]]
    for full in (*_FULL, *_ROUND):
        over = after + full - before
        if not ((over > 0.0) & (over <= BRIDGED_STEPS * usual)).all():
            continue
        if full in _ROUND and full not in _FULL and values[there[0]] <= np.max(after) + usual:
            continue
        rows = there[falls + 1]
        text = f"it begins anew at {full:.10g} {_where(rows, first_row)}: it is counted on"
        return _shifted(values, rows, full), [text]
    return values, []


def _jumps(time_s: FloatArray, off_s: float, least: float, most: float) -> Rows:
    """Returns the rows, from 0, in front of which the clock jumps by `off_s` beside its step."""
    there = np.flatnonzero(np.isfinite(time_s))
    steps = np.diff(time_s[there])
    if not (steps > 0.0).any():
        return there[:0]
    usual = float(np.median(steps[steps > 0.0]))
    over = (steps - off_s) / usual
    # A clock whose steps are longer than that has no jumps that can be told from steps.
    if usual > 0.01 * HOUR_S:
        return there[:0]
    return there[1:][(over > least) & (over <= most)]


def _shifted(values: FloatArray, rows: Rows, by: float) -> FloatArray:
    made = values.copy()
    for row in rows:
        made[row:] += by
    return made


def _where(rows: Rows, first_row: int) -> str:
    first = f"at row {int(rows[0]) + first_row}"
    return first if rows.size == 1 else f"{first} and {rows.size - 1} times later"
