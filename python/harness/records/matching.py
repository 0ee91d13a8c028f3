# SPDX-License-Identifier: MIT
"""Decides which series of a log is which channel, in which unit, and says why."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from ..base.numbers import FloatArray
from ..catalogue.channels import CHANNELS, COMMAND, POSITION, SPOOL, TIME
from .errors import RecordError, misnamed_column, missing_column, nearest_name
from .log import Log, Series
from .mapping import (
    NAMED_BY_RIG,
    PRESSURE_UNIT,
    Request,
    example_unit,
    how_to_name,
    map_option,
    units_differ,
)
from .names import (
    doubt_of_unit,
    is_counter,
    means,
    parts_of,
    says_other,
    split_unit,
    stated_unit,
    unit_in_name,
    unit_shown,
    words,
    words_of,
)
from .record import Taken
from .units import conversion, converts, gauge_remarks, is_other_unit, pint_unit, usual_units
from .values import sentinels_of


@dataclass(frozen=True)
class Choice:
    """A series that is read as a column of the record, and how."""

    series: Series
    taken: Taken

    def values(self) -> FloatArray:
        """Returns the values of the series in the unit of the record."""
        read = self.series.read()
        if self.taken.factor == 1.0 and self.taken.offset == 0.0:
            return read
        with np.errstate(over="ignore"):  # the record refuses infinite values
            return read * self.taken.factor + self.taken.offset


class Matching:
    """The choices for one log."""

    def __init__(self, log: Log, path: Path, request: Request) -> None:
        self._log = log
        self._path = path
        self._signals = [one for one in log.series if not one.is_time]
        self.remarks: list[str] = []  # sentences on what was guessed or left out
        self._only_length_name: str | None = None
        self._told: set[str] = set()  # channels that remarks tell of
        self.without_value: dict[str, str] = {}  # remarks on numbers for no value, by series
        self._maps, self._by_rig = request.stated([one.name for one in self._signals])
        self._units = {name: one.unit for name, one in self._maps.items() if one.unit is not None}
        self._by_maps = {
            (series.group, series.name): channel
            for channel, one in self._maps.items()
            for series in self._named(one.name)
        }

    def choose(self, wanted: Collection[str], required: Collection[str]) -> list[Choice]:
        """Returns the choices for the wanted columns but the time, in the order of `wanted`.

        A name that is no channel is the name of a series, which is read as it is.

        Raises
        ------
        RecordError
            a required column is not found, or not without doubt; the message says how to name it.
        """
        found = {name: self._series_of(name, name in required) for name in wanted if name != TIME}
        choices = []
        taken_by: dict[str, str] = {}
        for name, series in found.items():
            if series is None:
                continue
            other = taken_by.setdefault(f"{series.group}\0{series.name}", name)
            if other != name and name in CHANNELS and other in CHANNELS:
                problem = f"'{series.name}' is named for both '{other}' and '{name}'"
                raise self._refusal(problem, name, [series])
            choice = self._choice(name, series, name in required, found)
            if choice is not None:
                choices.append(choice)
        self.remarks += gauge_remarks({one.taken.column: one.taken.unit for one in choices})
        return choices

    def rest(self, choices: Sequence[Choice], times: Collection[str]) -> list[Choice]:
        """Returns the series that are no channel, under their own names and as they are."""
        used = {(one.series.group, one.series.name) for one in choices}
        names = {one.taken.channel for one in choices}
        rest: list[Choice] = []
        for series in self._signals:
            taken = (*times, *names, *self._log.texts, *CHANNELS, TIME)
            if (series.group, series.name) in used or series.name in taken:
                continue
            try:
                values = series.read()
            except RecordError as error:
                self.remarks.append(f"'{series.name}' is left out: {error.problem}")
                continue
            if not np.isfinite(values).any():
                self.remarks.append(f"'{series.name}' is left out: it is empty")
                continue
            names.add(series.name)
            series = self._with_gaps(series, series.name)
            why = "no channel of the schema; kept as it is"
            unit = unit_shown(series.name, series.unit)
            rest.append(Choice(series, Taken(series.name, series.name, unit, 1.0, 0.0, why)))
        return rest

    def missing(self, used: Sequence[Taken]) -> list[str]:
        """Returns remarks on command and position where no column was read as one of them."""
        made = {one.channel: one.column for one in used if one.channel in CHANNELS}
        remarks = []
        for channel in (COMMAND, POSITION):
            if channel in made or channel in self._told:
                continue
            # The "position of the valve" can be that of its spool, or the command.
            free = SPOOL if channel == COMMAND and SPOOL not in self._maps else None
            others = [column for other, column in made.items() if other != free]
            likely = self._likely(channel, others)
            names = " or ".join(f"'{one.name}'" for one in likely)
            options = " or ".join(self.map_option(channel, one) for one in likely or (None,))
            case = f"it is {names}" if likely else "the log has it"
            meaning = CHANNELS[channel].meaning
            remarks.append(f"no column was read as '{channel}' ({meaning}). If {case}: {options}")
        return remarks

    def _likely(self, channel: str, others: Collection[str]) -> list[Series]:
        """Returns up to three series that may be a channel, the likeliest first.

        They share a word with its names, or have its unit.
        """
        ranks: list[tuple[float, int, Series]] = []
        for i, one in enumerate(self._signals):
            unit = stated_unit(one.name, one.unit, channel)
            shared = len(words_of(channel).intersection(words(one.name)))
            unit_text = one.unit or split_unit(one.name)[1] or ""
            fraction = pint_unit(unit_text, SPOOL) is not None  # of the stroke, or no unit at all
            foreign = is_other_unit(unit_text, channel) and not fraction
            may_be = (channel, SPOOL) if channel == COMMAND else (channel,)
            known = any(means(one.name, other) for other in CHANNELS if other not in may_be)
            other = channel == POSITION and says_other(one.name)
            if one.name in others or foreign or known or other or is_counter(one.name):
                continue
            if shared or unit:
                ranks.append((shared + 2.0 * (unit is not None), -i, one))
        best = sorted(ranks, key=lambda rank: rank[:2], reverse=True)
        return [one for _, _, one in best[:3]]

    def _with_gaps(self, series: Series, channel: str) -> Series:
        """Returns a series with NaN in place of numbers that stand for no value."""

        @cache
        def values() -> FloatArray:
            read = series.read()
            none = sentinels_of(read, channel)
            if none is None:
                return read
            self.without_value[series.name] = none.remark(series.name, read)
            self.remarks.append(self.without_value[series.name])
            return none.without(read)

        return replace(series, read=values)

    def _named(self, name: str) -> list[Series]:
        """Returns the series of a name; the unit in brackets may be left out, and the case."""
        tests = (
            lambda one: one.name == name,
            lambda one: one.name.strip().casefold() == name.strip().casefold(),
            lambda one: split_unit(one.name)[0].casefold() == split_unit(name)[0].casefold(),
            lambda one: parts_of(one.name)[-1].casefold() == name.strip().casefold(),
        )
        for test in tests:
            found = [one for one in self._signals if test(one)]
            if found:
                return found
        return []

    def _series_of(self, name: str, required: bool) -> Series | None:
        if name in self._maps:
            found = self._named(self._maps[name].name)
            if not found:
                raise self._missing(name, self._maps[name].name)
        elif name not in CHANNELS:
            found = self._named(name)
        else:
            found = [one for one in self._signals if one.name == name] or [
                one
                for one in self._signals
                if not is_other_unit(one.unit, name) and means(one.name, name)
            ]
            found = self._free(name, [one for one in found if not is_counter(one.name)])
            if name == POSITION and not found:
                found = self._only_length()
        if len(found) == 1:
            return self._with_gaps(found[0], name)
        if len(found) > 1:
            listed = ", ".join(f"'{one.name}'" for one in found[:12])
            problem = f"{len(found)} columns can be '{name}': {listed}"
            remark = f"{problem}; none is read. To say which: {self.map_option(name, found[0])}"
            self._leave_out(name, remark, self._refusal(problem, name, found), required)
        elif required:
            raise self._missing(name, name)
        return None

    def _free(self, name: str, found: list[Series]) -> list[Series]:
        """Returns those that the user has named for no other channel; a remark if none is."""
        free = [one for one in found if (one.group, one.name) not in self._by_maps]
        if found and not free:
            series = found[0]
            other = self._by_maps[series.group, series.name]
            self.remarks.append(
                f"no column was read as '{name}': '{series.name}' was named for '{other}'"
            )
        return free

    def _only_length(self) -> list[Series]:
        """Returns the only series with a unit of length, if its name says nothing else."""
        lengths = [one for one in self._signals if stated_unit(one.name, one.unit, POSITION)]
        if len(lengths) != 1 or says_other(lengths[0].name):
            return []
        self._only_length_name = lengths[0].name
        self.remarks.append(
            f"'{lengths[0].name}' is taken for '{POSITION}', because no other column has a unit of "
            f"length. To say otherwise: {self.map_option(POSITION, None)}"
        )
        return lengths

    def _choice(
        self, name: str, series: Series, required: bool, found: Mapping[str, Series | None]
    ) -> Choice | None:
        if name not in CHANNELS:
            unit = "as it is" if series.unit is None else f"as it is, in {series.unit}"
            return Choice(series, Taken(name, series.name, None, 1.0, 0.0, f"named; {unit}"))
        why_name = "named" if name in self._maps else "by its name"
        if name == POSITION and series.name == self._only_length_name:
            why_name = "the only length"
        if name in self._by_rig:
            why_name = NAMED_BY_RIG
        doubt = self._doubt(name, series)
        if doubt is not None:
            line = self._line(name, series, example_unit(name) or CHANNELS[name].unit)
            remark = f"{doubt}: it is not read as '{name}'. To read it: {line}"
            self._leave_out(name, remark, self._doubtful(doubt, name, series, line), required)
            return None
        found_unit = self._unit(name, series) or self._guess(name, series, required, found)
        if found_unit is None:
            return None
        unit, why_unit = found_unit
        kept_as_is = name == COMMAND and not converts(unit, name)
        if kept_as_is and unit != "1":
            self.remarks.append(
                f"'{series.name}' is in {unit}, which is no voltage: its numbers are kept as "
                f"'{COMMAND}', so rated_command_v of a rig must be in {unit}, too"
            )
        factor, offset = conversion(unit, name)
        stated = unit if kept_as_is or unit not in (CHANNELS[name].unit, "1") else None
        why = f"{why_name}; {why_unit}"
        return Choice(series, Taken(name, series.name, stated, factor, offset, why))

    def _doubt(self, name: str, series: Series) -> str | None:
        """Returns what is in doubt about the unit that the log states, unless the user says it."""
        return None if name in self._units else doubt_of_unit(series.name, series.unit, name)

    def _leave_out(self, name: str, remark: str, error: RecordError, required: bool) -> None:
        """Remarks on a column that is not read, or raises the error where it is needed."""
        if required or name in self._maps:
            raise error
        self._told.add(name)
        self.remarks.append(remark)

    def _doubtful(self, doubt: str, name: str, series: Series, line: str) -> RecordError:
        units = "" if name == COMMAND else f", {usual_units(series.unit, CHANNELS[name].unit)}"
        units += ", also with a factor, such as 0.1 mm" if name == POSITION else ""
        expected, mend = f"a unit of '{name}'{units}", f"say the unit: {line}"
        return RecordError(self._path, doubt, column=series.name, expected=expected, mend=mend)

    def _unit(self, name: str, series: Series) -> tuple[str, str] | None:
        """Returns the unit in the notation of pint that is stated anywhere, and where; or None."""
        if name in self._units:
            unit, by_rig = self._units[name], name in self._by_rig
            self.remarks += units_differ(name, series.name, series.unit, unit, by_rig=by_rig)
            return unit, "unit as named"
        if series.unit is not None and series.unit.strip():
            stated = pint_unit(series.unit, name)
            if stated is not None:
                return stated, f"unit {series.unit.strip()} in the log"
        in_name = unit_in_name(series.name, name)
        if in_name is not None:
            return in_name, f"unit {in_name} in its name"
        if series.name == name:
            return CHANNELS[name].unit, "name of the schema"
        if name == COMMAND:
            return CHANNELS[name].unit, "no unit: taken as V"
        if name in self._by_rig:
            return CHANNELS[name].unit, "no unit there, nor in the log: that of the schema"
        return None

    def _guess(
        self, name: str, series: Series, required: bool, found: Mapping[str, Series | None]
    ) -> tuple[str, str] | None:
        """Returns a unit from the range of the values, where it leaves no doubt, and why."""
        size, what = self._size(name, series, found)
        guesses = CHANNELS[name].guesses
        fitting = [one.unit for one in guesses if one.lowest <= size <= one.highest]
        if len(fitting) == 1:
            others = [
                g.unit for g in guesses if g.lowest <= 20.0 * size and size <= 20.0 * g.highest
            ]
            others.remove(fitting[0])
            also = f" (less likely: {', '.join(others)})" if others else ""
            self.remarks.append(
                f"'{series.name}' has no unit: taken as {fitting[0]} because {what} is {size:.4g}"
                f"{also}. To say otherwise: {self.map_option(name, series)}"
            )
            return fitting[0], f"unit guessed: {what} is {size:.4g}"
        usual = (
            f"fits {' or '.join(fitting)}"
            if fitting
            else "does not fit any unit that is usual for it"
        )
        problem = (
            f"the unit of '{series.name}', taken for '{name}', is not stated, and {what}, "
            f"{size:.4g}, {usual}"
        )
        remark = f"{problem}: it is left out. To read it: {self.map_option(name, series)}"
        error = self._refusal(problem, name, [series], fitting or [g.unit for g in guesses])
        self._leave_out(name, remark, error, required)
        return None

    def _size(
        self, name: str, series: Series, found: Mapping[str, Series | None]
    ) -> tuple[float, str]:
        if name == POSITION:
            values = series.read()
            finite = values[np.isfinite(values)]
            return float(np.ptp(finite)) if finite.size else 0.0, "its travel"
        if CHANNELS[name].unit != PRESSURE_UNIT:
            return _largest(series.read()), "its largest value"
        # The pressures of a machine come from one source and, without a unit, from one logger.
        others = [
            one
            for channel, one in found.items()
            if one is not None
            and channel in CHANNELS
            and CHANNELS[channel].unit == PRESSURE_UNIT
            and self._doubt(channel, one) is None
            and self._unit(channel, one) is None
        ]
        return max(_largest(one.read()) for one in others), "the largest pressure"

    def map_option(self, channel: str, series: Series | None, unit: str | None = None) -> str:
        """Returns the option --map for a column, ready to paste; the unit is an example."""
        name = "COLUMN" if series is None else series.name
        if series is not None and channel in CHANNELS:
            unit = unit or stated_unit(series.name, series.unit, channel)
        return map_option(channel, name, example_unit(channel) if unit is None else unit)

    def _line(self, channel: str, series: Series | None, unit: str | None) -> str:
        """Returns the line of [columns] where the rig named the column, else the option --map."""
        if channel in self._by_rig and series is not None:
            return how_to_name(channel, series.name, unit, by_rig=True)
        return self.map_option(channel, series, unit)

    def _missing(self, channel: str, name: str) -> RecordError:
        names = [one.name for one in self._signals]
        if channel not in CHANNELS:
            return misnamed_column(self._path, name, names, "a column of this name")
        why = f"{CHANNELS[channel].meaning}, in {CHANNELS[channel].unit}"
        if channel in self._maps:
            misnamed = misnamed_column(self._path, name, names, why, self._log.kind)
            series = next((one for one in self._signals if one.name == misnamed.nearest), None)
            unit = self._maps[channel].unit
            if unit is None and series is not None:
                unit = pint_unit(series.unit or "", channel) or unit_in_name(series.name, channel)
            return misnamed.with_remedy(self._line(channel, series, unit))
        error = missing_column(self._path, name, names, why)
        near = nearest_name(channel, names)
        likely = self._likely(channel, ()) or [one for one in self._signals if one.name == near][:1]
        option = " or ".join(self.map_option(channel, one) for one in likely or (None,))
        error.problem += f" (read as {self._log.kind})"
        return error.changed(mend=f"{error.mend}, such as {option}")

    def _refusal(
        self, problem: str, name: str, series: Sequence[Series], units: Sequence[str] = ()
    ) -> RecordError:
        options = [self.map_option(name, series[0], unit) for unit in units]
        options = options or [self.map_option(name, one) for one in series]
        mend = f"say which is right: {' or '.join(options)}"
        return RecordError(
            self._path,
            problem,
            column=series[0].name,
            expected=f"one column for '{name}', with its unit",
            mend=mend if name in CHANNELS else "give the whole name of the one to read",
        )


def _largest(values: FloatArray) -> float:
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
