# SPDX-License-Identifier: MIT
"""Makes columns on one even time of the series that were chosen: as they are, filled, resampled."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..base.numbers import FloatArray
from ..catalogue.channels import COMMAND, POSITION, TIME
from .checks import (
    BRIDGED_STEPS,
    GAP_FACTOR,
    MAX_JITTER,
    TimeError,
    analyse_time,
    is_uniform,
    without_useless,
)
from .clock import Clock, Clocks
from .errors import RecordError
from .matching import Choice
from .uniform import (
    EQUAL,
    FILTER_RATIO,
    MISSING_STEPS,
    Grid,
    Rows,
    Timed,
    check_bridged,
    missing_rows,
    repaired,
    rounded,
    usual_step,
    with_rows,
)

MIN_VALUES = 2
NOT_WHOLE = "'{}' is left out: it does not cover the whole record"


class Maker:
    """Brings the chosen series to one time; `remarks` say what was done."""

    def __init__(self, path: Path, first_row: int, dt_s: float | None) -> None:
        self._path = path
        self._first_row = first_row
        self._dt_s = dt_s
        self._needed: Collection[str] = ()
        self.remarks: list[str] = []

    def make(
        self,
        choices: Sequence[Choice],
        clocks: Clocks,
        required: Collection[str],
        needs_time: bool,
    ) -> tuple[dict[str, FloatArray], Clock | None]:
        """Returns the columns of the record, the time among them if there is any, and its clock."""
        self._needed = {*required, COMMAND, POSITION}
        clock_of = {one.taken.channel: clocks.of(one.series) for one in choices}
        first = next((clock for clock in clock_of.values() if clock is not None), None)
        if first is None:
            return self._without_time(choices, needs_time), None
        timed = {
            one.taken.channel: self._timed(one, clock_of[one.taken.channel]) for one in choices
        }
        signals = {name: signal for name, signal in timed.items() if signal is not None}
        for name in (*required, *(() if signals else timed)):
            if name in timed and name not in signals:
                raise RecordError(
                    self._path,
                    "there are fewer than two values with a time",
                    column=name,
                    expected="a signal with a time",
                    mend="name another column with --map",
                )
        leading = _leading(signals, required)
        return self._together(self._covering(signals, leading), leading), first

    def even(self, columns: Mapping[str, FloatArray], error: TimeError) -> dict[str, FloatArray]:
        """Returns columns of the schema on an even time; `error` is why theirs is none.

        Raises
        ------
        RecordError
            `error`, where the time cannot be repaired.
        """
        mended = repaired(np.asarray(columns[TIME]), self.remarks)
        if mended is None:
            raise error
        signals = {
            name: Timed(mended[0], np.asarray(values)[mended[1]], held=name == COMMAND)
            for name, values in columns.items()
            if name != TIME
        }
        return self._together(signals, list(signals))

    def _covering(
        self, signals: Mapping[str, Timed], leading: Sequence[str]
    ) -> Mapping[str, Timed]:
        """Returns the signals without those that end long before the leading ones, or begin so."""
        start = max(float(signals[name].time_s[0]) for name in leading)
        end = min(float(signals[name].time_s[-1]) for name in leading)
        kept = {
            name: one
            for name, one in signals.items()
            if name in leading or _covers(one.time_s, start, end)
        }
        self.remarks += [NOT_WHOLE.format(name) for name in signals if name not in kept]
        return kept

    def _without_time(self, choices: Sequence[Choice], needs_time: bool) -> dict[str, FloatArray]:
        if needs_time:
            raise RecordError(
                self._path,
                "there is no time: no column looks like one, and no sampling time is stated",
                column=TIME,
                expected="the time of the samples",
                mend="say the sampling time in seconds, such as --dt 0.001, or the column, such as "
                "--map 'time_s=COLUMN [ms]'",
            )
        made = {one.taken.channel: one.values() for one in choices}
        kept, said = without_useless(made, self._needed, self._first_row)
        self.remarks += said
        return kept

    def _timed(self, choice: Choice, clock: Clock | None) -> Timed | None:
        name = choice.taken.channel
        if clock is None:
            self.remarks.append(f"'{choice.taken.column}' is left out: it has no time")
            return None
        values, time_s = choice.values(), clock.time_s
        there = np.isfinite(values) & np.isfinite(time_s)
        infinite = np.isinf(values)
        if infinite.any() and name not in self._needed:
            self.remarks += without_useless({name: values}, (), self._first_row)[1]
            return None
        if infinite.any():
            raise RecordError(
                self._path,
                f"row {int(np.argmax(infinite)) + self._first_row} is infinite",
                row=int(np.argmax(infinite)) + self._first_row,
                column=choice.taken.column,
                expected="a finite number in every row",
                mend="remove these rows",
            )
        if not there.all():
            empty = int(np.sum(~there))
            self.remarks.append(
                f"'{choice.taken.column}' has no value in {empty} of {there.size} rows"
            )
            values, time_s = values[there], time_s[there]
        if values.size < MIN_VALUES:
            return None
        before = list(self.remarks)
        mended = repaired(time_s, self.remarks)
        if mended is None:
            # The checks of a record have the words for what is wrong.
            analyse_time(time_s, file=self._path, first_row=self._first_row)
            raise RecordError(self._path, "its times are no clock", column=name)
        self.remarks = before + [one for one in self.remarks[len(before) :] if one not in before]
        return Timed(mended[0], values[mended[1]], held=name == COMMAND)

    def _together(
        self, signals: Mapping[str, Timed], leading: Sequence[str]
    ) -> dict[str, FloatArray]:
        """Returns the signals and their time; they stay as they are where they are even already.

        `leading` are the names of those whose rate and span the others get.
        """
        first = signals[leading[0]].time_s
        same = all(np.array_equal(one.time_s, first) for one in signals.values())
        dt_s = self._dt_s
        if same and is_uniform(first):
            step = usual_step(first)
            rows = missing_rows(first, step)
            if (dt_s is None or abs(dt_s - step) <= EQUAL * step) and (rows >= 0).all():
                signals = self._filled(signals, rows, step)
                time_s = next(iter(signals.values())).time_s
                return {TIME: time_s.copy(), **{name: one.values for name, one in signals.items()}}
        return self._resampled(signals, leading, same)

    def _filled(
        self,
        signals: Mapping[str, Timed],
        rows: Rows,
        step: float,
    ) -> Mapping[str, Timed]:
        """Returns signals on one even time with the single rows that are missing."""
        bridged = int(rows.sum())
        if bridged:
            points = rows.size + 1 + bridged
            check_bridged(self._path, bridged, points, step)
            signals = with_rows(signals, rows)
            self._say_bridged(bridged, points, signals)
        steps = np.diff(next(iter(signals.values())).time_s)
        gaps = steps[steps > GAP_FACTOR * step]
        if gaps.size:
            self.remarks.append(
                f"{gaps.size + 1} pieces are left between gaps of more than "
                f"{round(BRIDGED_STEPS) - 1} rows, the longest of {float(gaps.max()):.3g} s; the "
                "gaps are not filled"
            )
        return signals

    def _say_bridged(self, bridged: int, points: int, signals: Mapping[str, Timed]) -> None:
        held = [name for name, one in signals.items() if one.held]
        text = (
            f"{bridged} of {points} samples ({100.0 * bridged / points:.2g} %) lie in holes of "
            "single rows and are interpolated"
        )
        self.remarks.append(text + (f"; {', '.join(held)} is held there" if held else ""))

    def _resampled(
        self, signals: Mapping[str, Timed], leading: Sequence[str], same: bool
    ) -> dict[str, FloatArray]:
        steps = {name: usual_step(one.time_s) for name, one in signals.items()}
        dt_s = self._dt_s or rounded(max(steps[name] for name in leading))
        start = max(float(signals[name].time_s[0]) for name in leading)
        end = min(float(signals[name].time_s[-1]) for name in leading)
        if end - start < dt_s:
            raise RecordError(
                self._path,
                "the signals have no time in common",
                expected="signals that were logged at the same time",
                mend="name the columns of one run with --map",
            )
        grid = Grid(start, end, dt_s, self._path)
        made: dict[str, FloatArray] = {}
        valid = np.ones(grid.time_s.size, dtype=bool)
        bridged = 0
        for name in leading:
            made[name], count = grid.sample(signals[name])
            bridged = max(bridged, count)
            valid &= np.isfinite(made[name])
        check_bridged(self._path, bridged, grid.time_s.size, dt_s)
        if np.count_nonzero(valid) < MIN_VALUES:
            raise RecordError(
                self._path,
                f"at a step of {dt_s:.4g} s no two samples lie beside each other",
                expected="rows at a nearly even rate",
                mend="give a longer step with --dt, or log at a fixed rate",
            )
        for name in (name for name in signals if name not in leading):
            made_one = self._optional(name, signals[name], grid, steps[name])
            if np.isfinite(made_one[valid]).all():
                made[name] = made_one
            else:
                self.remarks.append(NOT_WHOLE.format(name))
        self._say(steps, leading, grid, bridged, int(np.count_nonzero(~valid)), same, signals)
        order = [name for name in signals if name in made]
        return {TIME: grid.time_s[valid], **{name: made[name][valid] for name in order}}

    @staticmethod
    def _optional(name: str, signal: Timed, grid: Grid, step: float) -> FloatArray:
        """Returns a further signal on the grid; its ends are held for up to one of its steps."""
        made, _ = grid.sample(signal)
        time_s, values = signal.time_s, signal.values
        early = (grid.time_s < time_s[0]) & (grid.time_s >= time_s[0] - 1.5 * step)
        late = (grid.time_s > time_s[-1]) & (grid.time_s <= time_s[-1] + 1.5 * step)
        made[early & np.isnan(made)] = values[0]
        made[late & np.isnan(made)] = values[-1]
        return made

    def _say(
        self,
        steps: Mapping[str, float],
        leading: Sequence[str],
        grid: Grid,
        bridged: int,
        left_out: int,
        same: bool,
        signals: Mapping[str, Timed],
    ) -> None:
        time_s = signals[leading[0]].time_s
        between = np.diff(time_s)
        regular = between[between <= 1.5 * np.median(between)]
        wavers = float(np.max(np.abs(regular / steps[leading[0]] - 1.0)))
        why = f"steps vary by up to {100.0 * wavers:.3g} %"
        if same and wavers <= MAX_JITTER:
            why = "a step is no whole number of usual ones"
        if self._dt_s is not None:
            why = f"from {1e3 * steps[leading[0]]:.4g} ms"
        rates = sorted({f"{1e3 * step:.4g}" for step in steps.values()}, key=float)
        if not same and len(rates) > 1:
            why = f"signals every {', '.join(rates)} ms"
        elif not same and wavers <= MAX_JITTER:
            why = "its signals have values at different times"
        filtered = [
            n for n in signals if grid.dt_s >= FILTER_RATIO * steps[n] and not signals[n].held
        ]
        text = f"resampled to an even {grid.dt_s:.6g} s ({why})"
        if filtered:
            text += f"; {', '.join(filtered)} filtered below {0.5 / grid.dt_s:.4g} Hz before"
        self.remarks.append(text)
        slow = [n for n in signals if steps[n] > FILTER_RATIO * grid.dt_s]
        if slow:
            self.remarks.append(
                f"{', '.join(slow)}: logged more slowly, interpolated, and held at the ends; above "
                f"{0.5 / max(steps[n] for n in slow):.3g} Hz nothing was measured"
            )
        if bridged:
            self._say_bridged(bridged, int(grid.time_s.size) - left_out, signals)
        if left_out:
            self.remarks.append(
                f"{left_out} samples lie in gaps, which divide the record and are not filled"
            )


def _leading(signals: Mapping[str, Timed], required: Collection[str]) -> list[str]:
    """Returns the signals whose rate and span the record gets.

    They are the required ones with command and position, else the fastest that are there in the
    whole record.
    """
    found = [name for name in signals if name in (*required, COMMAND, POSITION)]
    if found:
        return found
    steps = {name: usual_step(one.time_s) for name, one in signals.items()}
    fast = [name for name, step in steps.items() if step <= FILTER_RATIO * min(steps.values())]
    longest = max((signals[name].time_s for name in fast), key=np.ptp)
    start, end = float(longest[0]), float(longest[-1])
    return [name for name in fast if _covers(signals[name].time_s, start, end)]


def _covers(time_s: FloatArray, start: float, end: float) -> bool:
    """Whether a signal is there from start to end, but for up to one and a half of its steps."""
    room = MISSING_STEPS * usual_step(time_s)
    return bool(time_s[0] <= start + room and time_s[-1] >= end - room)
