# SPDX-License-Identifier: MIT
"""`ehsid.watch`: the same history as the command, as a result of Python."""

from __future__ import annotations

from pathlib import Path

import pytest
from dated_logs import write_machine

import ehsid
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.watch import watching
from ehsid.harness.watch.store import FILE
from ehsid.harness.watch.tracking import Estimated, Told

LEAK = "effects.internal_leakage.coefficient_m3_s_pa"
WEEKS = 20


def leaks_more_from_week_12_on(record: Record, rig: Rig, effects: tuple[str, ...]) -> Told:
    week = int(record.name.split("-")[-1])
    noise = 1e-14 * (-1) ** week
    return Told((Estimated(LEAK, "m^3/(s Pa)", (3e-12 if week >= 12 else 1e-12) + noise, 1e-13),))


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(watching, "estimated", leaks_more_from_week_12_on)
    return write_machine(tmp_path / "press7", WEEKS)


def test_a_history_is_told_drawn_saved_and_a_frame(machine: Path, tmp_path: Path) -> None:
    told = ehsid.watch(machine, tmp_path / "history", workers=1, progress=False)
    (one,) = told.machines
    (change,) = one.changed[0].changes
    assert change.date90[0] <= "2026-03-27" <= change.date90[1]  # between weeks 11 and 12
    assert "Something changed in press7." in repr(told)
    assert "rose by" in told.summary()
    assert len(told.plot().axes) == 1
    frame = told.to_polars()
    assert frame.shape == (WEEKS, 7)
    assert frame["value"][12] == pytest.approx(3e-12, rel=0.01)
    assert (tmp_path / "history" / FILE).is_file()
    folder = told.save(tmp_path / "page")
    assert sorted(path.name for path in folder.glob("watch.*")) == ["watch.html", "watch.json"]


def test_what_cannot_be_watched_names_the_argument(machine: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"^track: there is no effect 'leakage'; expected one of"):
        ehsid.watch(machine, tmp_path / "history", track=["leakage"])
    assert not (tmp_path / "history").exists()
    told = ehsid.watch(machine, tmp_path / "history", workers=1, progress=False)
    with pytest.raises(ValueError, match="there is no machine 'press8': expected one of press7"):
        told.plot("press8")
