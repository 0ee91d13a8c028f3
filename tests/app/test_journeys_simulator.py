# SPDX-License-Identifier: MIT
"""Journeys through the workbench with a simulator of the user in the rig file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from test_journeys import drop, press, see, session_of
from user_simulators import FOLDER, needs_linux64

import ehsid

pytestmark = needs_linux64


def log_of(path: Path, seconds: float) -> Path:
    """Write the log of a machine that is the simulator, but for friction of its seals."""
    rng = np.random.default_rng(3)
    samples = round(500 * seconds)
    command = np.cumsum(rng.standard_normal(samples))
    command = 2.5 * np.sin(np.arange(samples) * 0.02) + 0.05 * (command - command.mean())
    friction = {"effects.coulomb_friction.force_n": 1500.0}
    run = ehsid.simulate(FOLDER / "rig.toml", command, dt_s=0.002, values=friction, noise=True)
    run.record.save(path)
    return path


def test_a_rig_with_a_simulator_is_taken_and_checked(
    page: Any, served: Any, tmp_path: Path
) -> None:
    drop(page, log_of(tmp_path / "run.csv", 4.0))
    see(page, "6 columns, 2000 rows")
    drop(page, FOLDER / "rig.toml")
    see(page, "drop bench.fmu here, too, or give the path of the rig file on this machine")
    drop(page, FOLDER / "bench.fmu")
    see(page, "the rig file that waited for it is the rig of this machine now (bench).")
    press(page, "3 Rig")
    see(page, "Its simulator is yours: simulator/bench.fmu.")
    see(page, "Cannot be judged: counterbalance valve, entrained air")
    press(page, "Describe the machine anew")
    page.get_by_label("the path of a rig file on this machine").fill(str(FOLDER / "rig.toml"))
    press(page, "Use this rig file")
    see(page, f"Its simulator is yours: {FOLDER / 'bench.fmu'}.")
    press(page, "Next: Check")
    page.get_by_role("button", name="Next: Gap").wait_for()
    assert session_of(served).settings.made_of.keys() == {"check"}


def test_the_diagnosis_runs_the_simulator(page: Any, served: Any, tmp_path: Path) -> None:
    drop(page, log_of(tmp_path / "run.csv", 12.0), FOLDER / "rig.toml", FOLDER / "bench.fmu")
    see(page, "rig.toml is the rig of this machine now (bench).")
    see(page, "6 columns, 6000 rows")
    press(page, "3 Rig")
    press(page, "Next: Check")
    press(page, "Next: Gap")
    press(page, "Start the diagnosis")
    page.get_by_text("The gap is due to Coulomb friction").first.wait_for(timeout=600_000)
    assert session_of(served).settings.made_of.keys() == {"check", "gap"}
