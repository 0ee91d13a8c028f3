# SPDX-License-Identifier: MIT
"""A history of a press over a year, as `ehsid watch` writes it, without a fit."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

import ehsid
from ehsid.harness.show.watch_page import write_watch
from ehsid.harness.watch.store import Row
from ehsid.harness.watch.tracking import Estimated, Told
from ehsid.harness.watch.watching import Watch, watched

FIRST = datetime(2026, 1, 5, 8, tzinfo=UTC)
SEED, WEEKS, REPAIRED, EXCHANGED = 5, 52, 30, 41


def made_history(folder: Path) -> None:
    """Writes a leak that grows and is repaired, another valve, and oil that follows the seasons."""
    rng = np.random.default_rng(SEED)
    rows = []
    for week in range(WEEKS):
        oil = 45.0 - 10.0 * float(np.cos(2.0 * np.pi * week / WEEKS))
        leak = 2e-13 * max(0, week - 12) if week < REPAIRED else 0.0
        told = (
            _estimate("effects.internal_leakage.coefficient_m3_s_pa", leak, 1e-13, rng),
            _estimate("effects.valve_dead_band.overlap", 0.02 * (week >= EXCHANGED), 4e-4, rng),
            _estimate("load.viscous_friction_n_s_m", 9000.0 - 60.0 * (oil - 40.0), 150.0, rng),
        )
        date = FIRST + timedelta(weeks=week)
        rows.append(Row(f"{date:%Y-%m-%d}.csv", date, Told(told, oil)))
    folder.mkdir(parents=True)
    machine = watched("press7", rows)
    write_watch(Watch(1, ehsid.__version__, 1.0, (machine,)), folder)


def _estimate(name: str, value: float, deviation: float, rng: np.random.Generator) -> Estimated:
    unit = next(one.unit for one in ehsid.plant_parameters() if one.name == name)
    return Estimated(name, unit, value + float(rng.normal(0.0, deviation)), deviation)
