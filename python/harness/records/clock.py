# SPDX-License-Identifier: MIT
"""Finds the times of the values of a series, in seconds, whatever the log calls and counts them.

Clocks that are put forward or back, and counters that begin anew, are made to run on.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.numbers import FloatArray
from ..catalogue.channels import TIME
from .checks import BRIDGED_STEPS, GAP_FACTOR
from .errors import MisnamedColumnError, RecordError, misnamed_column
from .log import Log, Series
from .mapping import Request, how_to_name, map_option, units_differ
from .names import doubt_of_unit, is_counter, means, parts_of, says, split_unit, unit_in_name
from .record import DATES, Taken
from .uniform import Rows
from .units import SECONDS, conversion, is_other_unit, pint_unit, usual_units

# Steps of servo records in seconds, with some room.
LEAST_STEP_S, MOST_STEP_S = 2e-5, 0.25
# Counts since 1970, from 2001 to 2096, by unit.
SINCE_1970 = {"s": (1e9, 4e9), "ms": (1e12, 4e12), "us": (1e15, 4e15), "ns": (1e18, 4e18)}
# Days since the year 0 (MATLAB) and since 1900 (spreadsheets), from 1954 to 2119.
DAYS = ((714_000.0, 774_000.0), (20_000.0, 80_000.0))
SMALL_STEP_DAYS = 1e-3
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


@dataclass(frozen=True)
class Clock:
    """Times of the rows of a group in seconds, shape (n,), and what they were taken from."""

    time_s: FloatArray
    taken: Taken


class Clocks:
    """The clocks of a log by group; `remarks` are sentences on what was guessed."""

    def __init__(self, log: Log, path: Path, request: Request) -> None:
        maps, by_rig = request.stated([one.name for one in log.series])
        self._log = log
        self._path = path
        self._named = maps.get(TIME)
        self._by_rig = TIME in by_rig
        self._dt_s = request.hints.dt_s
        self._found: dict[tuple[str, int], Clock | None] = {}
        self.remarks: list[str] = []

    def of(self, series: Series) -> Clock | None:
        """Returns the clock of a series, or None where the log has no time.

        Raises
        ------
        RecordError
            the column named for the time is not there.
        """
        if series.time is not None and self._named is None:
            why = "time of the values in the log"
            return Clock(series.time(), Taken(TIME, "", None, 1.0, 0.0, why))
        key = series.group, series.size
        if key not in self._found:
            self._found[key] = self._find(series)
        return self._found[key]

    def columns(self) -> set[str]:
        """Returns the columns that are the time of any series; remarks on other dates."""
        clocks = (self.of(one) for one in self._log.series if one.time is None)
        used = {clock.taken.column for clock in clocks if clock is not None}
        self.remarks += [
            f"'{one.name}' is left out: the time is '{min(used)}'"
            for one in self._log.series
            if used and one.is_time and not any(one.name in name for name in used)
        ]
        return used

    def _find(self, series: Series) -> Clock | None:
        group = [
            one for one in self._log.series if one.group == series.group and one.size == series.size
        ]
        candidates = self._candidates(group)
        if candidates:
            time = candidates[0]
            return self._read(time)
        if self._dt_s is None:
            self._say_useless(group)
        stated, why = self._dt_s, "from --dt"
        if stated is None and self._log.dt_s is not None:
            stated, why = self._log.dt_s, "as the file states"
            self.remarks.append(
                f"there is no column of time: the sampling time of {stated:.6g} s is the one that "
                "the file states. To say otherwise: --dt SECONDS"
            )
        if stated is None:
            return None
        rows = stated * np.arange(series.size, dtype=np.float64)
        return Clock(rows, Taken(TIME, "", None, 1.0, 0.0, f"{stated:.6g} s between rows, {why}"))

    def _say_useless(self, group: Sequence[Series]) -> None:
        """Remarks on what seems to be the time and is no clock; raises the error of a damaged one.

        A time with a damaged cell is no log without time.
        """
        for one in group:
            if one.is_time or (not is_counter(one.name) and means(_given(one.name), TIME)):
                one.read()
                self.remarks.append(
                    f"'{one.name}' is not used as the time: most of its values do not rise"
                )

    def _candidates(self, group: Sequence[Series]) -> list[Series]:
        if self._named is not None:
            name = self._named.name.strip().casefold()
            named_so = [
                one
                for one in self._log.series
                if name in (one.name.casefold(), split_unit(one.name)[0].casefold())
            ]
            found = [one for one in named_so if one in group]
            if not named_so:
                names = [one.name for one in self._log.series]
                raise self._misnamed(names)
            return found
        named = [one for one in group if one.name == TIME]
        if named:
            return named
        # The last one of dates is that of date and time of day together.
        dates = [one for one in group if one.is_time][::-1]
        numbers = [
            one
            for one in group
            if not one.is_time
            and not is_counter(one.name)
            and means(_given(one.name), TIME)
            and not is_other_unit(one.unit, TIME)
        ]
        usable = [one for one in numbers if _runs(one)]
        return usable + [one for one in dates if _runs(one)]

    def _misnamed(self, names: Sequence[str]) -> MisnamedColumnError:
        assert self._named is not None
        error = misnamed_column(self._path, self._named.name, names, "the column of time")
        near = next((one for one in self._log.series if one.name == error.nearest), None)
        column = "COLUMN" if near is None else near.name
        unit = self._named.unit
        if unit is None:
            stated = pint_unit(near.unit or "", TIME) if near is not None else None
            unit = stated or unit_in_name(column, TIME)
        return error.with_remedy(how_to_name(TIME, column, unit, by_rig=self._by_rig))

    def _read(self, time: Series) -> Clock:
        if time.is_time:
            values = time.read()
            if time.local:
                values, said = put_right(values, self._log.first_row)
                self.remarks += [f"'{time.name}': {one}" for one in said]
            why = f"{DATES}, counted from the first"
            return Clock(values, Taken(TIME, time.name, None, 1.0, 0.0, why))
        values, said = unwrapped(time.read(), self._log.first_row)
        self.remarks += [f"'{time.name}': {one}" for one in said]
        unit, why, guessed = self._unit(time, values)
        if guessed:
            self.remarks.append(
                f"'{time.name}' has no unit: taken as {unit} because {why}. To say otherwise: "
                f"--map '{TIME}={split_unit(time.name)[0]} [{'s' if unit != 's' else 'ms'}]'"
            )
        start = 0.0
        if why.startswith("it counts"):
            start = float(values[np.isfinite(values)][0])
        factor = SECONDS.get(unit) or conversion(unit, TIME)[0]
        kept = None if unit == "s" else unit
        seconds = (values - start) * factor if start else values if unit == "s" else values * factor
        return Clock(seconds, Taken(TIME, time.name, kept, factor, -start * factor, why))

    def _unit(self, time: Series, values: FloatArray) -> tuple[str, str, bool]:
        """Returns the unit, the reason, and whether it is only a guess."""
        if self._named is not None and self._named.unit:
            named = self._named.unit
            self.remarks += units_differ(TIME, time.name, time.unit, named, by_rig=self._by_rig)
            return named, "named; unit as named", False
        if time.name == TIME and not time.unit:
            return "s", "name of the schema", False
        finite = values[np.isfinite(values)]
        since = None
        for one, (low, high) in SINCE_1970.items():
            if (
                finite.size
                and low <= min(finite[0], finite[-1])
                and max(finite[0], finite[-1]) <= high
            ):
                since = one
        doubt = doubt_of_unit(_given(time.name), time.unit, TIME)
        if doubt is not None:
            raise RecordError(
                self._path,
                doubt,
                column=time.name,
                expected=f"a unit of time, {usual_units(time.unit, 's')}",
                mend=f"say the unit: {map_option(TIME, split_unit(time.name)[0], '0.1 ms')}",
            )
        in_name = [says(part, TIME) for part in parts_of(_given(time.name))]
        said = time.unit or next((unit for unit in in_name if isinstance(unit, str)), "")
        stated = pint_unit(said, TIME) if said else None
        if stated is not None:
            counts = "it counts from 1970; " if since else ""
            return stated, f"{counts}unit {stated} in the log", False
        if since is not None:
            return since, "it counts from 1970", False
        step = float(np.median(np.diff(finite))) if finite.size > 1 else 0.0
        if step < SMALL_STEP_DAYS and any(low <= finite[0] <= high for low, high in DAYS):
            return "day", "it counts days of the calendar", False
        for unit in ("s", "ms", "us", "ns"):
            if LEAST_STEP_S <= step * SECONDS[unit] <= MOST_STEP_S:
                clear = unit == "s"
                return unit, f"its step is {step:.4g}", not clear
        return "s", f"its step is {step:.4g}", True


def _given(name: str) -> str:
    """Returns the name in the log of a second column of the same name, such as "Time [s] (2)"."""
    return re.sub(r" \(\d+\)$", "", name)


def _runs(time: Series) -> bool:
    """Whether the values of a series can be times: numbers, most of which rise."""
    try:
        values = time.read()
    except RecordError:
        return False
    finite = values[np.isfinite(values)]
    return (
        finite.size > 1
        and bool(np.ptp(finite) > 0.0)
        and bool(np.mean(np.diff(finite) >= 0.0) > 0.5)
    )


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
