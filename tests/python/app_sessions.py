# SPDX-License-Identifier: MIT
"""Sessions for tests: logs of a simulated bench with German names, and its rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from sources import ROOT

from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import simulate
from ehsid.workbench.reading import read_log
from ehsid.workbench.session import Entry, Session

BENCH = ROOT / "examples" / "rigs" / "bench.toml"
HEAD = "Zeit [ms];Stellgröße [V];Weg [mm];Druck A [bar];Druck B [bar]"
ANSWERS = {
    "bore": "63 mm",
    "rod": "35 mm",
    "stroke": "300 mm",
    "supply": "120 bar",
    "rated-flow": "38 l/min",
    "rated-drop": "35 bar",
    "mass": "120 kg",
}


def german_log(path: Path, seconds: float = 4.0, phase: float = 0.0) -> Path:
    """Write the log of a logger with decimal commas and its own names; the bench has friction."""
    time_s = 1e-3 * np.arange(int(1e3 * seconds))
    command = 2.0 * np.sin(2.0 * np.pi * 1.3 * time_s + phase) + np.sign(np.sin(5.0 * time_s))
    rig = read_rig(BENCH).with_values({"effects.coulomb_friction.force_n": 400.0})
    made = simulate(rig, command, dt_s=1e-3).record.columns
    noise = np.random.default_rng(int(10 * phase)).normal(0.0, 1e-2, time_s.size)
    columns = (
        1e3 * time_s,
        command,
        1e3 * made["position_m"] + noise,
        1e-5 * made["pressure_a_pa"] + noise,
        1e-5 * made["pressure_b_pa"] + noise,
    )
    rows = (
        ";".join(f"{value:.6g}".replace(".", ",") for value in row)
        for row in zip(*columns, strict=True)
    )
    path.write_text("\n".join([HEAD, *rows]) + "\n", encoding="utf-8")
    return path


def read_session(folder: Path, *logs: Path) -> Session:
    """Return a session whose logs are read."""
    session = Session(folder)
    for log in logs:
        read_log(session, session.add(log))
    return session


def entry_of(session: Session, place: int = 0) -> Entry:
    """Return a record of a session."""
    return session.settings.records[place]
