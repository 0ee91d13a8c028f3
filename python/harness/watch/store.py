# SPDX-License-Identifier: MIT
"""The history of machines in one SQLite file: a log that is in it is never fitted again.

The tables are read by any SQLite tool: `log` has one row for each log and `estimate` one for each
quantity that it tells. What determines the estimates of a log is kept with it: the digests of log
and rig file, the effects that are watched, and the version of ehsid.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass
from datetime import datetime
from pathlib import Path

from .logs import DatedLog
from .tracking import Estimated, Told

FILE = "history.sqlite"
# Number of the layout of the tables below.
LAYOUT = 1
TABLES = """
CREATE TABLE IF NOT EXISTS log (
    id INTEGER PRIMARY KEY, machine TEXT NOT NULL, name TEXT NOT NULL, date TEXT NOT NULL,
    sha256 TEXT NOT NULL, settings TEXT NOT NULL, temperature_c REAL, refused TEXT NOT NULL,
    UNIQUE (machine, name));
CREATE TABLE IF NOT EXISTS estimate (
    log INTEGER NOT NULL REFERENCES log (id) ON DELETE CASCADE, quantity TEXT NOT NULL,
    unit TEXT NOT NULL, value REAL NOT NULL, deviation REAL NOT NULL,
    PRIMARY KEY (log, quantity));
"""


@dataclass(frozen=True)
class Fitted:
    """A log that was fitted, on its way into the history."""

    log: DatedLog
    sha256: str
    """Digest of its file."""
    settings: str
    """What else determines what it tells."""
    told: Told


@dataclass(frozen=True)
class Row:
    """A log in the history."""

    name: str
    date: datetime
    told: Told


class History:
    """The history in a file that is open."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def settings(self, machine: str) -> dict[str, tuple[str, str]]:
        """Returns digest and settings of each log of a machine, by name."""
        found = self._connection.execute(
            "SELECT name, sha256, settings FROM log WHERE machine = ?", (machine,)
        )
        return {name: (sha256, settings) for name, sha256, settings in found}

    def add(self, fitted: Fitted) -> None:
        """Adds a log, in place of an earlier one of this name; all of it or nothing."""
        log, told = fitted.log, fitted.told
        with self._connection as to:
            to.execute(
                "DELETE FROM log WHERE machine = ? AND name = ?", (log.machine, log.path.name)
            )
            added = to.execute(
                "INSERT INTO log (machine, name, date, sha256, settings, temperature_c, refused) "
                "VALUES (?, ?, ?, ?, ?, ?, ?)",
                (
                    *(log.machine, log.path.name, log.date.isoformat()),
                    *(fitted.sha256, fitted.settings, told.temperature_c, told.refused),
                ),
            )
            to.executemany(
                "INSERT INTO estimate VALUES (?, ?, ?, ?, ?)",
                [(added.lastrowid, *astuple(estimate)) for estimate in told.estimates],
            )

    def rows(self, machine: str, names: Sequence[str]) -> list[Row]:
        """Returns these logs of a machine, oldest first, with what they tell."""
        of_log: dict[int, list[Estimated]] = {}
        for log, *estimate in self._connection.execute(
            "SELECT log, quantity, unit, value, deviation FROM estimate "
            "JOIN log ON log.id = estimate.log WHERE machine = ?",
            (machine,),
        ):
            of_log.setdefault(log, []).append(Estimated(*estimate))
        wanted = set(names)
        return [
            Row(name, datetime.fromisoformat(date), Told(tuple(of_log.get(key, ())), warm, refused))
            for key, name, date, warm, refused in self._connection.execute(
                "SELECT id, name, date, temperature_c, refused FROM log WHERE machine = ? "
                "ORDER BY date, name",
                (machine,),
            )
            if name in wanted
        ]


@contextmanager
def opened(path: Path) -> Iterator[History]:
    """Opens the history, and makes it where there is none.

    Raises
    ------
    ValueError
        the file is no history of this layout.
    """
    connection = sqlite3.connect(path)
    try:
        connection.execute("PRAGMA foreign_keys = ON")
        (layout,) = connection.execute("PRAGMA user_version").fetchone()
        if layout not in (0, LAYOUT):
            raise ValueError(
                f"{path}: is a history of layout {layout}, expected {LAYOUT}: name another folder"
            )
        connection.executescript(TABLES)
        connection.execute(f"PRAGMA user_version = {LAYOUT}")
        yield History(connection)
    except sqlite3.DatabaseError as error:
        raise ValueError(
            f"{path}: cannot be used as a history: {error}; remove the file to begin anew"
        ) from None
    finally:
        connection.close()
