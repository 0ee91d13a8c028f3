# SPDX-License-Identifier: MIT
"""Fits the logs that are new in a folder, and tells what changed in each machine, and when."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.stats import norm

import ehsid

from ..base.error_words import error_words
from ..base.exchange import sha256_of
from ..base.files import temporary_folder
from ..base.parallel import is_on_cluster, run_surviving
from ..catalogue.parameters import effects as catalogue
from ..catalogue.spellings import ParameterKey
from ..records import Record
from ..records.errors import nearest_name
from ..rigs import Rig, read_rig
from .changes import BASELINE, LEVEL, Change, Course, changes, levels, threshold
from .logs import RIG, DatedLog, dated_logs, machines_in
from .store import Fitted, History, Row
from .tracking import GAP, SERVO, WEAR, Told, estimated, tracked_effects

# Days of the shortest history from which the number of logs a year is told.
LEAST_DAYS = 30.0
YEAR = 365.25

KILLED = (
    "the process that fitted it was killed, and so was the second one; perhaps the memory is not "
    "enough: take a shorter log. It is tried again when its content or its name changes"
)

# Reads a log with the layout that the rig file names; raises ValueError or OSError where it cannot.
Read = Callable[[Path, Rig], Record]


@dataclass(frozen=True)
class WatchedChange:
    """A change of a quantity, with dates."""

    kind: Literal["step", "growth"]
    """A step, or the begin of a growth."""
    date: str
    date90: tuple[str, str]
    """Most probable date, and the interval that holds it with 90 %; ISO 8601."""
    size: float
    size90: tuple[float, float]
    """The step, or the growth in a month, with its interval of 90 %; unit of the quantity."""
    noticed: str
    """Date of the log that gave the alarm."""


@dataclass(frozen=True)
class WatchedQuantity:
    """The course of a quantity over N logs."""

    name: str
    unit: str
    dates: tuple[str, ...]
    values: tuple[float, ...]
    deviations: tuple[float, ...]
    """Of each log the date, the estimate, and its standard deviation within the log."""
    pooled: tuple[float, ...]
    pooled90: tuple[tuple[float, float], ...]
    """The same with the other logs of its time, and its interval of 90 %."""
    could_be_seen: tuple[float, ...]
    """Step that two logs like this one would have shown, with a probability of 90 %."""
    changes: tuple[WatchedChange, ...]
    """Oldest first."""

    @property
    def now(self) -> tuple[float, float, float]:
        """Pooled value of the last log, and its interval."""
        return (self.pooled[-1], *self.pooled90[-1])


@dataclass(frozen=True)
class WatchedMachine:
    """A machine and what its logs tell."""

    name: str
    logs: int
    first: str
    last: str
    """Number of logs that could be fitted, and dates of the first and the last one."""
    refused: Mapping[str, str]
    """Logs that tell nothing, with the reason."""
    oil_temperature: tuple[tuple[str, float], ...]
    """Date and mean temperature of the oil of each log, °C; its influence is taken out. Empty where
    not all logs have it."""
    quantities: tuple[WatchedQuantity, ...]
    """Those with changes first."""

    @property
    def changed(self) -> tuple[WatchedQuantity, ...]:
        """Quantities with a change."""
        return tuple(each for each in self.quantities if each.changes)


@dataclass(frozen=True)
class Watch:
    """What `watch.json` has."""

    schema_version: Literal[1]
    ehsid_version: str
    false_alarms_a_year: float
    """Alarms a year of each machine on which nothing changes, for all quantities together."""
    machines: tuple[WatchedMachine, ...]


@dataclass(frozen=True)
class MachineLogs:
    """The logs of a machine, and what they are fitted with."""

    name: str
    rig: Rig
    effects: tuple[str, ...]
    """Ids of the effects that are watched."""
    settings: str
    """What else than the log determines what it tells: version, rig file and effects."""
    logs: tuple[DatedLog, ...]
    """Oldest first."""


def logs_in(
    folder: Path, effects: Sequence[str] = WEAR, rig_file: Path | None = None
) -> list[MachineLogs]:
    """Returns the machines of a folder with their logs; nothing is written.

    With `rig_file` the folder is that of one machine, and needs no rig file of its own.

    Raises
    ------
    ValueError
        the folder has no machine, a rig file is wrong, a log has no date in its name, or an effect
        is not in the catalogue.
    """
    for effect in effects:
        if effect not in catalogue():
            raise ValueError(
                f"--track: there is no effect '{effect}'; expected one of 'ehsid effects', such as "
                f"'{nearest_name(effect, list(catalogue()))}'"
            )
    machines = []
    for machine in machines_in(folder, rig_file):
        of_machine = rig_file or machine / RIG
        rig = read_rig(of_machine)
        tracked = tracked_effects(rig, effects)
        settings = json.dumps([ehsid.__version__, sha256_of(of_machine), *tracked])
        name, logs = machine.resolve().name, tuple(dated_logs(machine))
        machines.append(MachineLogs(name, rig, tracked, settings, logs))
    return machines


@dataclass(frozen=True)
class NewLog:
    """A log that is to be fitted."""

    log: DatedLog
    sha256: str
    """Digest of its file."""
    of: MachineLogs
    """Its machine."""

    def fitted(self, told: Told) -> Fitted:
        """Returns the log with what it tells."""
        return Fitted(self.log, self.sha256, self.of.settings, told)


def new_logs(machines: Sequence[MachineLogs], history: History) -> list[NewLog]:
    """Returns the logs that the history does not have yet as they are now."""
    found = []
    for machine in machines:
        known = history.settings(machine.name)
        for log in machine.logs:
            digest = sha256_of(log.path)
            if known.get(log.path.name) != (digest, machine.settings):
                found.append(NewLog(log, digest, machine))
    return found


def fit_and_keep(new: Sequence[NewLog], history: History, read: Read) -> Generator[Fitted]:
    """Fits logs on all cores or a cluster; each is in the history before it is yielded.

    A log whose process is killed, for example for want of memory, is kept as one that tells
    nothing.
    """

    def task_of(one: NewLog) -> Callable[[], Told]:
        path, given = one.log.path, (one.of.rig, one.of.effects, read)
        if not is_on_cluster():
            return functools.partial(_told, path, *given)
        try:
            return functools.partial(_told_there, path, path.read_bytes(), *given)
        except OSError as error:
            return functools.partial(Told, refused=error_words(error) or str(error))

    for one, told in run_surviving(new, task_of):
        fitted = one.fitted(told or Told(refused=KILLED))
        history.add(fitted)
        yield fitted


def _told(path: Path, rig: Rig, effects: tuple[str, ...], read: Read) -> Told:
    try:
        return estimated(read(path, rig), rig, effects)
    except Exception as error:  # whatever a log has, it does not end the others
        words = error_words(error) if isinstance(error, ValueError | OSError) else None
        return Told(refused=words or f"{type(error).__name__}: {error}")


def _told_there(path: Path, content: bytes, rig: Rig, effects: tuple[str, ...], read: Read) -> Told:
    """Fits a log on a computer that does not have it; messages name it as the user does."""
    with temporary_folder() as folder:
        copy = folder / path.name
        copy.write_bytes(content)
        told = _told(copy, rig, effects, read)
    return replace(told, refused=told.refused.replace(str(copy), str(path)))


def told_of(machines: Sequence[MachineLogs], history: History) -> Watch:
    """Returns what the history tells of the logs that are in the folders now."""
    told = [
        watched(each.name, history.rows(each.name, [log.path.name for log in each.logs]))
        for each in machines
    ]
    return Watch(1, ehsid.__version__, 1.0, tuple(told))


def watched(name: str, rows: Sequence[Row]) -> WatchedMachine:
    """Returns what the logs of a machine tell, oldest first in `rows`."""
    told = [row for row in rows if not row.told.refused]
    refused = {row.name: row.told.refused for row in rows if row.told.refused}
    oil = tuple(
        (row.date.isoformat(), row.told.temperature_c)
        for row in told
        if row.told.temperature_c is not None
    )
    warm = bool(told) and len(oil) == len(told)
    names = dict.fromkeys(e.quantity for row in told for e in row.told.estimates)
    usable = [
        quantity
        for quantity in names
        if sum(any(e.quantity == quantity for e in row.told.estimates) for row in told) > BASELINE
    ]
    quantities = [_quantity(quantity, told, len(usable), warm) for quantity in usable]
    quantities.sort(key=lambda each: (not each.changes, _rank(each.name)))
    dates = [row.date.isoformat() for row in told] or [""]
    return WatchedMachine(
        name, len(told), dates[0], dates[-1], refused, oil if warm else (), tuple(quantities)
    )


def _rank(quantity: str) -> int:
    """Effects first, then values of the rig, the servo, and the gap that stays."""
    if quantity == GAP:
        return 3
    if quantity in SERVO.values():
        return 2
    return 0 if ParameterKey(quantity).effect is not None else 1


def _quantity(quantity: str, told: Sequence[Row], count: int, warm: bool) -> WatchedQuantity:
    rows, estimates = [], []
    for row in told:
        for estimate in row.told.estimates:
            if estimate.quantity == quantity:
                rows.append(row)
                estimates.append(estimate)
    first = rows[0].date
    days = np.array([(row.date - first).total_seconds() / 86400.0 for row in rows])
    covariates = np.empty((len(rows), 0))
    if warm:
        temperature = np.array([float(row.told.temperature_c or 0.0) for row in rows])
        if np.ptp(temperature) > 0.0:
            covariates = (temperature - temperature.mean())[:, np.newaxis]
    course = Course(
        days,
        np.array([estimate.value for estimate in estimates]),
        np.array([estimate.deviation for estimate in estimates]),
        covariates,
    )
    limit = threshold(YEAR * len(rows) / max(float(days[-1]), LEAST_DAYS), count)
    found = changes(course, limit)
    pooled = levels(course, found, limit)
    reach = float(norm.ppf(0.5 + LEVEL / 2)) * pooled.deviation
    return WatchedQuantity(
        quantity,
        estimates[0].unit,
        tuple(row.date.isoformat() for row in rows),
        tuple(course.values.tolist()),
        tuple(course.deviations.tolist()),
        tuple(pooled.mean.tolist()),
        tuple(zip((pooled.mean - reach).tolist(), (pooled.mean + reach).tolist(), strict=True)),
        tuple(pooled.seen.tolist()),
        tuple(_dated(change, first) for change in found),
    )


def _dated(change: Change, first: datetime) -> WatchedChange:
    def date(day: float) -> str:
        return (first + timedelta(days=day)).isoformat(timespec="minutes")

    low, high = change.days90
    return WatchedChange(
        change.kind,
        date(change.day),
        (date(low), date(high)),
        change.size,
        change.size90,
        date(change.noticed),
    )
