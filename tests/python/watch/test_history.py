# SPDX-License-Identifier: MIT
"""Dated logs, their history in a file, and what is told of it."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from ehsid.harness.show.watch_page import change_rows
from ehsid.harness.watch.logs import DatedLog, date_of, dated_logs, machines_in
from ehsid.harness.watch.store import FILE, Fitted, Row, opened
from ehsid.harness.watch.tracking import GAP, Estimated, Told
from ehsid.harness.watch.watching import Watch, watched

FIRST = datetime(2026, 1, 1, tzinfo=UTC)
LEAK = "effects.internal_leakage.coefficient_m3_s_pa"


@pytest.mark.parametrize(
    ("name", "date"),
    [
        ("2026-03-17.csv", (2026, 3, 17, 12, 0)),
        ("run_20260317T0830.csv", (2026, 3, 17, 8, 30)),
        ("press7 2026_03_17 08.30.15.mf4", (2026, 3, 17, 8, 30, 15)),
        ("press 12 - 2026.12.31_23-59.csv", (2026, 12, 31, 23, 59)),
        ("run7.csv", None),
        ("2026-13-17.csv", None),
        ("2026-02-30.csv", None),
        ("120260317.csv", None),
    ],
)
def test_the_date_stands_in_the_name(name: str, date: tuple[int, ...] | None) -> None:
    expected = None if date is None else datetime(*date, tzinfo=UTC)  # type: ignore[arg-type,misc]
    assert date_of(name) == expected


def test_logs_are_sorted_by_date_and_need_one(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").touch()
    # Neither the order of the names nor that in which they are made.
    names = ["m_2026-01-02.csv", "z_2026-01-03.csv", "a_2026-01-04.csv"]
    for name in (names[1], names[2], names[0]):
        (tmp_path / name).write_text("x")
    assert [log.path.name for log in dated_logs(tmp_path)] == names
    assert machines_in(tmp_path) == [tmp_path]
    (tmp_path / "run7.csv").write_text("x")
    with pytest.raises(ValueError, match=r"no date in the name of run7\.csv: expected one such as"):
        dated_logs(tmp_path)


def test_a_folder_has_a_machine_or_several(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"has no rig\.toml: expected it beside the logs"):
        machines_in(tmp_path)
    for name in ("press2", "press1", "notes"):
        (tmp_path / name).mkdir()
    for name in ("press1", "press2"):
        (tmp_path / name / "rig.toml").touch()
    assert [machine.name for machine in machines_in(tmp_path)] == ["press1", "press2"]
    with pytest.raises(ValueError, match="there is no such folder"):
        machines_in(tmp_path / "none")


def log(day: int, *estimates: Estimated, refused: str = "", machine: str = "press7") -> Fitted:
    date = FIRST + timedelta(days=day)
    dated = DatedLog(machine, Path(f"{date:%Y-%m-%d}.csv"), date)
    return Fitted(dated, f"sha{day}", "settings", Told(estimates, 41.5, refused))


def test_a_history_keeps_each_log_once(tmp_path: Path) -> None:
    leak = Estimated(LEAK, "m^3/(s Pa)", 1e-12, 1e-13)
    with opened(tmp_path / FILE) as history:
        history.add(log(3, leak))
        history.add(log(1, refused="too short"))
        history.add(log(3, leak, Estimated(GAP, "1", 0.1, 0.01)))  # the same log again
        history.add(log(3, machine="press8"))
    with opened(tmp_path / FILE) as history:
        assert history.settings("press7") == {
            "2026-01-02.csv": ("sha1", "settings"),
            "2026-01-04.csv": ("sha3", "settings"),
        }
        first, second = history.rows("press7", ["2026-01-02.csv", "2026-01-04.csv", "gone.csv"])
        assert (first.told.refused, first.told.temperature_c) == ("too short", 41.5)
        assert [each.quantity for each in second.told.estimates] == [LEAK, GAP]
        assert second.told.estimates[0] == leak
        assert history.rows("press7", []) == []


def test_a_file_that_is_no_history_is_refused(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("not a database, but long enough to be taken for one" * 20)
    with pytest.raises(ValueError, match="cannot be used as a history"), opened(tmp_path / FILE):
        pass
    newer = tmp_path / "newer.sqlite"
    with opened(newer) as history:
        history._connection.execute("PRAGMA user_version = 99")
    with pytest.raises(ValueError, match="layout 99, expected 1"), opened(newer):
        pass


def rows(count: int = 40, warm: bool = False, step: float = 0.0) -> list[Row]:
    rng = np.random.default_rng(4)
    made = []
    for day in range(count):
        temperature = 45.0 + 10.0 * np.cos(day / 7.0)
        value = 10.0 + (step if day >= 25 else 0.0) + (0.5 * temperature if warm else 0.0)
        estimate = Estimated(LEAK, "m^3/(s Pa)", value + float(rng.normal(0.0, 0.2)), 0.2)
        told = Told((estimate,), float(temperature) if warm else None)
        made.append(Row(f"{day}.csv", FIRST + timedelta(days=9 * day), told))
    return made


def test_a_step_has_a_date() -> None:
    machine = watched("press7", rows(step=3.0))
    (leak,) = machine.changed
    (change,) = leak.changes
    date = (FIRST + timedelta(days=9 * 24.5)).isoformat()
    assert change.date90[0] < date < change.date90[1]
    assert change.size == pytest.approx(3.0, abs=0.3)  # five deviations of its mean
    assert leak.now[0] == pytest.approx(13.0, abs=0.3)
    assert leak.now[1] < leak.now[0] < leak.now[2]


def test_a_fall_is_told_without_signs() -> None:
    machine = watched("press7", rows(step=-3.0))
    ((name, _, words, _),) = change_rows(Watch(1, "1.0", 1.0, (machine,)))
    assert name == "press7"
    assert re.fullmatch(
        r"fell by [^-]+ l/min at 100 bar \([^-]+ to [^-]+\)", words.replace("\u00a0", " ")
    )


def test_the_temperature_of_the_oil_is_no_change() -> None:
    warm = watched("press7", rows(warm=True))
    assert warm.oil_temperature
    assert warm.changed == ()
    # Without it the seasons are taken for changes.
    unknown = [Row(row.name, row.date, Told(row.told.estimates)) for row in rows(warm=True)]
    assert watched("press7", unknown).changed


def test_too_few_logs_and_refused_ones_are_told() -> None:
    few = watched("press7", rows(5))
    assert (few.logs, few.quantities) == (5, ())
    refused = Row("6.csv", FIRST, Told(refused="too short"))
    machine = watched("press7", [*rows(5), refused])
    assert machine.refused == {"6.csv": "too short"}
    nothing = watched("press7", [refused])
    assert (nothing.logs, nothing.first) == (0, "")
