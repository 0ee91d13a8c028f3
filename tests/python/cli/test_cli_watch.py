# SPDX-License-Identifier: MIT
"""`ehsid watch` on folders of dated logs, with a stand-in for the fit of a log."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from dated_logs import write_log, write_machine
from offline_pages import read
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.watch import watching
from ehsid.harness.watch.tracking import Estimated, Told

pytestmark = pytest.mark.usefixtures("blank_pictures", "no_plots")

LEAK = "effects.internal_leakage.coefficient_m3_s_pa"
COUNT, STEP = 24, 15
fitted: list[str] = []


def stand_in(record: Record, rig: Rig, effects: tuple[str, ...]) -> Told:
    """A leak that is three times as large from the sixteenth log on; each record has its mark."""
    assert "coulomb_friction" in effects
    day = int(record.name.split("-")[-1])
    fitted.append(record.name)
    size = 3e-12 if day >= STEP else 1e-12
    noise = float(np.random.default_rng(day).normal(0.0, 1e-13))
    return Told((Estimated(LEAK, "m^3/(s Pa)", size + noise, 1e-13),))


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine with a log a week; the last part of the name is the number of the week."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(watching, "estimated", stand_in)
    fitted.clear()
    return write_machine(tmp_path / "press7", COUNT)


def run(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(cli, ["watch", *words, "--out", "history", "--workers", "1"])
    return done.exit_code, done.output


def test_a_change_has_a_date_and_new_logs_alone_are_fitted(machine: Path) -> None:
    code, said = run("press7")
    assert code == 0, said
    assert "Something changed in press7." in said
    assert len(fitted) == COUNT
    written = json.loads(Path("history/watch.json").read_text())
    (told,) = written["machines"]
    (change,) = told["quantities"][0]["changes"]
    assert change["kind"] == "step"
    assert change["date90"][0] <= "2026-04-16T12:00+00:00" <= change["date90"][1]
    page = Path("history/watch.html").read_text(encoding="utf-8")
    assert change["size"] == pytest.approx(2e-12, abs=2e-13)
    # 2e-12 m^3/(s Pa) are 1.2 l/min at 100 bar.
    assert re.search(r"rose by 1\.[12]\d* l/min at 100 bar", page.replace("\u00a0", " "))
    assert not [link for link in read(page).found if "://" in link]
    # A log that is there is not fitted again; one that changed and a new one are.
    write_log(machine, COUNT)
    first = min(machine.glob("*.csv"))
    first.write_text(first.read_text() + "\n")
    code, _ = run("press7", "--fail-on", "change")
    assert code == 3
    assert sorted(fitted[COUNT:]) == sorted([first.stem, f"2026-06-22-{COUNT}"])
    # Other effects are another question.
    code, said = run("press7", "--track", "coulomb_friction")
    assert (code, len(fitted)) == (0, 2 * COUNT + 3)


def test_a_log_that_cannot_be_read_is_named_and_the_others_are_told(machine: Path) -> None:
    (machine / "2026-12-24-99.csv").write_text("this is no record\n")
    code, said = run("press7")
    assert code == 0
    assert "1 log could not be used: 2026-12-24-99.csv (" in said
    assert "2026-12-24-99.csv: " in Path("history/watch.html").read_text(encoding="utf-8")
