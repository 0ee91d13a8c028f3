# SPDX-License-Identifier: MIT
"""Decides which series of a log is which channel, in which unit, and says why."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.channels import CHANNELS, COMMAND, POSITION, SPOOL, TIME
from ..checks import sentinels_of
from ..errors import RecordError, misnamed_column, missing_column, nearest_name
from ..layout import gauge_remarks, usual_units
from ..mapping import NAMED_BY_RIG, Request, columns_line, map_option, units_differ
from ..record import Taken
from .log import Log, Series
from .names import (
    doubt_of_unit,
    is_counter,
    means,
    parts_of,
    says_other,
    unit_in_name,
    words,
    words_of,
)
from .units import (
    conversion,
    converts,
    is_other_unit,
    pint_unit,
    split_unit,
    unit_shown,
    without_unit,
)

PRESSURE_UNIT = "Pa"


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
    """The choices for one log; `remarks` are sentences on what was guessed or left out.

    `without_value` are those on numbers that stand for no value, by the name of the series.
    """

    def __init__(self, log: Log, path: Path, request: Request) -> None:
        self._log = log
        self._path = path
        self._signals = [one for one in log.series if not one.is_time]
        self.remarks: list[str] = []
        self._only_length_name: str | None = None
        self._told: set[str] = set()  # channels that remarks tell of
        self.without_value: dict[str, str] = {}
        self._maps, self._by_rig = request.stated([one.name for one in self._signals])

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
                raise self._refusal(
                    f"'{series.name}' is named for both '{other}' and '{name}'", name, [series]
                )
            choice = self._choice(name, series, name in required, found)
            if choice is not None:
                choices.append(choice)
        self.remarks += gauge_remarks({one.taken.column: one.taken.unit for one in choices})
        return choices

    def rest(self, choices: Sequence[Choice], times: Collection[str]) -> list[Choice]:
        """Returns the series that are no channel, under their own names and as they are."""
        used = {(one.series.group, one.series.name) for one in choices}
        names = {one.taken.channel for one in choices}
        rest = []
        for series in self._signals:
            taken = (*times, *names, *self._log.texts, TIME)
            known = (series.group, series.name) in used or series.name in taken
            if known or series.name in CHANNELS:
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
        made = {one.channel for one in used}
        others = [one.column for one in used if one.channel in CHANNELS]
        remarks = []
        for channel in (COMMAND, POSITION):
            if channel in made or channel in self._told:
                continue
            likely = self._likely(channel, others)
            names = " or ".join(f"'{one.name}'" for one in likely)
            options = self._options(channel, likely)
            ask = f"If it is {names}: " if likely else "If the log has it: "
            meaning = CHANNELS[channel].meaning
            remarks.append(f"no column was read as '{channel}' ({meaning}). {ask}{options}")
        return remarks

    def _options(self, channel: str, likely: Sequence[Series]) -> str:
        """Returns the option --map for each of the likely series, or that for any column."""
        options = [self.map_option(channel, one) for one in likely]
        return " or ".join(options or [self.map_option(channel, None)])

    def _likely(self, channel: str, others: Collection[str]) -> list[Series]:
        """Returns up to three series that may be a channel, the likeliest first.

        They share a word with its names, or have its unit.
        """
        ranks: list[tuple[float, int, Series]] = []
        for i, one in enumerate(self._signals):
            unit = _stated_unit(one, channel)
            shared = len(words_of(channel).intersection(words(one.name)))
            unit_text = one.unit or split_unit(one.name)[1] or ""
            fraction = pint_unit(unit_text, SPOOL) is not None  # of the stroke, or no unit at all
            foreign = is_other_unit(unit_text, channel) and not fraction
            known = any(means(one.name, other) for other in CHANNELS if other != channel)
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
                one for one in self._signals if self._means(one, name)
            ]
            found = [one for one in found if not is_counter(one.name)]
            if name == POSITION and not found:
                found = self._only_length()
        if len(found) == 1:
            return self._with_gaps(found[0], name)
        if len(found) > 1:
            problem = f"{len(found)} columns can be '{name}': {_listed(found)}"
            if required or name in self._maps:
                raise self._refusal(problem, name, found)
            self._told.add(name)
            self.remarks.append(
                f"{problem}; none is read. To say which: {self.map_option(name, found[0])}"
            )
            return None
        if required:
            raise self._missing(name, name)
        return None

    def _only_length(self) -> list[Series]:
        """Returns the only series with a unit of length, if its name says nothing else."""
        lengths = [one for one in self._signals if _stated_unit(one, POSITION) is not None]
        if len(lengths) != 1 or says_other(lengths[0].name):
            return []
        self._only_length_name = lengths[0].name
        self.remarks.append(
            f"'{lengths[0].name}' is taken for '{POSITION}', because no other column has a unit of "
            f"length. To say otherwise: {self.map_option(POSITION, None)}"
        )
        return lengths

    @staticmethod
    def _means(series: Series, channel: str) -> bool:
        return not is_other_unit(series.unit, channel) and means(series.name, channel)

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
            self._leave_out(doubt, name, series, required)
            return None
        found_unit = self._unit(name, series)
        if found_unit is None:
            found_unit = self._guess(name, series, required, found)
        if found_unit is None:
            return None
        unit, why_unit = found_unit
        if name == COMMAND and not converts(unit, name):
            if unit != "1":
                self.remarks.append(
                    f"'{series.name}' is in {unit}, which is no voltage: its numbers are kept as "
                    f"'{COMMAND}', so rated_command_v of a rig must be in {unit}, too"
                )
            return Choice(
                series, Taken(name, series.name, unit, 1.0, 0.0, f"{why_name}; {why_unit}")
            )
        factor, offset = conversion(unit, name)
        kept = None if unit == CHANNELS[name].unit or unit == "1" else unit
        return Choice(
            series, Taken(name, series.name, kept, factor, offset, f"{why_name}; {why_unit}")
        )

    def _doubt(self, name: str, series: Series) -> str | None:
        """Returns what is in doubt about the unit that the log states, unless the user says it."""
        mapped = self._maps.get(name)
        if mapped is not None and mapped.unit is not None:
            return None
        return doubt_of_unit(series.name, series.unit, name)

    def _leave_out(self, doubt: str, name: str, series: Series, required: bool) -> None:
        """Remarks on a column with a doubtful unit, or refuses it where it is needed."""
        line = self._line(name, series, self._example(name) or CHANNELS[name].unit)
        if not required and name not in self._maps:
            self._told.add(name)
            self.remarks.append(f"{doubt}: it is not read as '{name}'. To read it: {line}")
            return
        units = "" if name == COMMAND else f", {usual_units(series.unit, CHANNELS[name].unit)}"
        raise RecordError(
            self._path,
            doubt,
            column=series.name,
            expected=f"a unit of '{name}'{units}, also with a factor, such as 0.1 mm"
            if name == POSITION
            else f"a unit of '{name}'{units}",
            mend=f"say the unit: {line}",
        )

    def _unit(self, name: str, series: Series) -> tuple[str, str] | None:
        """Returns the unit in the notation of pint that is stated anywhere, and where; or None."""
        mapped = self._maps.get(name)
        if mapped is not None and mapped.unit is not None:
            by_rig = name in self._by_rig
            self.remarks += units_differ(name, series.name, series.unit, mapped.unit, by_rig=by_rig)
            return mapped.unit, "unit as named"
        if series.unit is not None and series.unit.strip():
            stated = pint_unit(series.unit, name)
            if stated is not None:
                return stated, f"unit {series.unit.strip()} in the log"
        unit = unit_in_name(series.name, name)
        if unit is not None:
            return unit, f"unit {unit} in its name"
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
                one.unit
                for one in guesses
                if one.unit != fitting[0]
                and one.lowest <= 20.0 * size
                and size <= 20.0 * one.highest
            ]
            also = f" (less likely: {', '.join(others)})" if others else ""
            self.remarks.append(
                f"'{series.name}' has no unit: taken as {fitting[0]} because {what} is {size:.4g}"
                f"{also}. To say otherwise: {self.map_option(name, series)}"
            )
            return fitting[0], f"unit guessed: {what} is {size:.4g}"
        could = " or ".join(fitting) if fitting else "any unit that is usual for it"
        problem = (
            f"the unit of '{series.name}', taken for '{name}', is not stated, and {what}, "
            f"{size:.4g}, fits {could}"
            if fitting
            else f"the unit of '{series.name}', taken for '{name}', is not stated, and {what}, "
            f"{size:.4g}, does not fit {could}"
        )
        if required or name in self._maps:
            raise self._refusal(problem, name, [series], fitting or [g.unit for g in guesses])
        self._told.add(name)
        self.remarks.append(
            f"{problem}: it is left out. To read it: {self.map_option(name, series)}"
        )
        return None

    def _size(
        self, name: str, series: Series, found: Mapping[str, Series | None]
    ) -> tuple[float, str]:
        if name == POSITION:
            return _travel(series.read()), "its travel"
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
        name = "COLUMN"
        if series is not None:
            known = channel in CHANNELS
            name = without_unit(series.name, channel) if known else series.name
            unit = unit or _stated_unit(series, channel)
        return map_option(channel, name, self._example(channel) if unit is None else unit)

    @staticmethod
    def _example(channel: str) -> str | None:
        """Returns a unit in which logs often have a channel; None where it has but one."""
        if channel == POSITION:
            return "mm"
        guesses = CHANNELS[channel].guesses if channel in CHANNELS else ()
        if guesses and CHANNELS[channel].unit == PRESSURE_UNIT:
            return "bar"
        return guesses[1].unit if len(guesses) > 1 else None

    def _line(self, channel: str, series: Series | None, unit: str | None) -> str:
        """Returns the line of [columns] where the rig named the column, else the option --map."""
        if channel in self._by_rig and series is not None:
            return f"in [columns] of the rig, {columns_line(channel, series.name, unit)}"
        return self.map_option(channel, series, unit)

    def _missing(self, channel: str, name: str) -> RecordError:
        names = [one.name for one in self._signals]
        why = (
            f"{CHANNELS[channel].meaning}, in {CHANNELS[channel].unit}"
            if channel in CHANNELS
            else "a column of this name"
        )
        if channel not in CHANNELS:
            return misnamed_column(self._path, name, names, why)
        if channel in self._maps:
            misnamed = misnamed_column(self._path, name, names, why, self._log.kind)
            near = misnamed.nearest
            series = next((one for one in self._signals if one.name == near), None)
            unit = self._maps[channel].unit
            if unit is None and series is not None:
                unit = pint_unit(series.unit or "", channel) or unit_in_name(series.name, channel)
            return misnamed.with_remedy(self._line(channel, series, unit))
        error = missing_column(self._path, name, names, why)
        likely = self._likely(channel, ())
        near = nearest_name(channel, names)
        likely = likely or [one for one in self._signals if one.name == near][:1]
        option = self._options(channel, likely)
        error.problem += f" (read as {self._log.kind})"
        return error.changed(mend=f"{error.mend}, such as {option}")

    def _refusal(
        self, problem: str, name: str, series: Sequence[Series], units: Sequence[str] = ()
    ) -> RecordError:
        if units:
            options = [self.map_option(name, series[0], unit) for unit in units]
        else:
            options = [self.map_option(name, one) for one in series]
        return RecordError(
            self._path,
            problem,
            column=series[0].name,
            expected=f"one column for '{name}', with its unit",
            mend=f"say which is right: {' or '.join(options)}",
        )


def _stated_unit(series: Series, channel: str) -> str | None:
    """Returns the unit of a channel that the log states, in the notation of pint; None if none."""
    stated = (series.unit or "").strip() or split_unit(series.name)[1]
    unit = None if stated is None else pint_unit(stated, channel)
    return None if unit == "1" else unit


def _listed(series: Sequence[Series]) -> str:
    return ", ".join(f"'{one.name}'" for one in series[:12])


def _largest(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.max(np.abs(finite))) if finite.size else 0.0


def _travel(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if finite.size else 0.0
