# SPDX-License-Identifier: MIT
"""Makes the life of docs/watch.md and its picture: python docs/watch/make.py [FOLDER]

It takes about two minutes on two cores. With FOLDER the logs and the history are kept there.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.show.plotting import write_figure
from ehsid.harness.show.watch_page import life_figure
from ehsid.harness.watch.logs import dated_logs
from ehsid.harness.watch.store import FILE, opened
from ehsid.harness.watch.watching import watched
from ehsid.lab.reality.effects import Sizes
from ehsid.lab.reality.lives import make_life

SEED, LOGS = 11, 40
FIRST = datetime(2026, 1, 1, tzinfo=UTC)
# Days of the year: wear begins, repair, another valve.
WEARS, REPAIRED, EXCHANGED = 90.0, 210.0, 280.0
SHOWN = ("internal_leakage", "valve_dead_band", "valve_null_bias", "bulk_modulus", "viscous")


def plan(day: float) -> Mapping[str, Sizes]:
    """A leak of 1.2 l/min at 100 bar more each month, until it is repaired; later another valve."""
    sizes: dict[str, Sizes] = {}
    if WEARS <= day < REPAIRED:
        sizes["internal_leakage"] = {"coefficient_m3_s_pa": 2e-12 * (day - WEARS) / 30.0}
    if day >= EXCHANGED:
        sizes["valve_dead_band"] = {"overlap": 0.02}
        sizes["valve_null_bias"] = {"offset": 0.006}
    return sizes


def write_life(folder: Path) -> None:
    """Writes rig file and logs."""
    days = np.sort(np.random.default_rng(SEED).uniform(0.0, 365.0, LOGS))
    rig, logs = make_life(SEED, days.tolist(), plan, season_c=10.0, logs_temperature=True)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.toml").write_text(rig, encoding="utf-8")
    for log in logs:
        date = FIRST + timedelta(days=log.day)
        table = np.stack(list(log.columns.values()), axis=1)
        name = f"{date:%Y%m%dT%H%M}.csv"
        header = ",".join(log.columns)
        np.savetxt(folder / name, table, "%.9g", ",", header=header, comments="")


def main(place: Path) -> None:
    """Makes the life, watches it, and saves the picture beside this file."""
    machine, history = place / "press7", place / "history"
    write_life(machine)
    done = CliRunner().invoke(cli, ["watch", str(machine), "--out", str(history)])
    print(done.output)
    with opened(history / FILE) as kept:
        rows = kept.rows(machine.name, [log.path.name for log in dated_logs(machine)])
    told = watched(machine.name, rows)
    shown = [one for one in told.quantities if any(part in one.name for part in SHOWN)]
    write_figure(Path(__file__).parent / "life.png", life_figure(shown, told.oil_temperature))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary))
