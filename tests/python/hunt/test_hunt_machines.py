# SPDX-License-Identifier: MIT
"""Machines behind one interface, and experiments that run on them within limits."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from gap_rig import RIG

from ehsid.harness.diagnosis.limits import Limits
from ehsid.harness.hunt.machines import LOGGED, ProgramMachine, SimulatedMachine, machine_of
from ehsid.harness.hunt.running import Experiment, run_experiment
from ehsid.harness.rigs import write_rig
from ehsid.harness.signals.simulation import simulate

DT_S = 1e-3
LIMITS = Limits((0.05, 0.2), 10.0)
MIDDLE = 0.5 * RIG.values["cylinder.stroke_m"]
AXIS = '''
class Axis:
    """A speed that follows the command at once."""

    inputs = ("command_v",)
    outputs = ("position_m", "pressure_a_pa")

    def reset(self):
        self.y = 0.125
        return [self.y, 6e6]

    def step(self, dt, command_v):
        self.y += dt * 0.05 * command_v
        return [self.y, 6e6]


WITHOUT_READ = 3
'''


def test_a_rig_plays_the_machine_as_the_simulator_runs_it() -> None:
    command = 2.0 * np.sin(np.arange(300) * 0.05)
    machine = SimulatedMachine(RIG, LOGGED, dt_s=DT_S, seed=1)
    shown = []
    for one in command:
        shown.append(dict(machine.read()))
        machine.step(float(one))
    run = simulate(RIG, command, dt_s=DT_S).record
    for name in LOGGED:
        # The same steps on the same plant.
        np.testing.assert_array_equal([one[name] for one in shown], run.column(name))


def test_a_file_is_a_rig_or_a_program(tmp_path: Path) -> None:
    write_rig(RIG, tmp_path / "machine.toml")
    (tmp_path / "axis.py").write_text(AXIS)
    rig = machine_of(tmp_path / "machine.toml", dt_s=DT_S, seed=1, outputs=("position_m",))
    assert isinstance(rig, SimulatedMachine)
    assert list(rig.read()) == ["position_m"]
    program = machine_of(f"{tmp_path}/axis.py:Axis", dt_s=DT_S, seed=1)
    assert isinstance(program, ProgramMachine)
    assert dict(program.read()) == {"position_m": 0.125, "pressure_a_pa": 6e6}
    program.step(4.0)
    assert program.read()["position_m"] == pytest.approx(0.125 + DT_S * 0.2)
    with pytest.raises(ValueError, match="expected a class with reset and step"):
        machine_of(f"{tmp_path}/axis.py:WITHOUT_READ", dt_s=DT_S, seed=1)
    with pytest.raises(ValueError, match=r"nowhere\.py:Axis: there is no such file"):
        machine_of(f"{tmp_path}/nowhere.py:Axis", dt_s=DT_S, seed=1)


def whole_record(command_v: object, dt: float) -> Mapping[str, object]:
    return {"position_m": command_v}


def test_a_function_of_a_whole_record_cannot_be_stopped_within_a_run() -> None:
    with pytest.raises(ValueError, match="it gets a whole command: expected a class of Python"):
        machine_of(whole_record, dt_s=DT_S, seed=1)


class Pure:
    """Moves as it is sent; `faster` than the rig by this factor."""

    name = "pure"

    def __init__(self, faster: float = 1.0) -> None:
        self.position, self.sent = 0.1, list[float]()
        self._gain = 0.03 * faster

    def read(self) -> Mapping[str, float]:
        return {"position_m": self.position}

    def step(self, command_v: float) -> None:
        self.sent.append(command_v)
        self.position += DT_S * self._gain * command_v


def swing(speed_v: float, seconds: float = 4.0) -> Experiment:
    command = np.where(np.arange(round(seconds / DT_S)) % 2000 < 1000, speed_v, -speed_v)
    path = MIDDLE + np.cumsum(command) * DT_S * 0.03
    return Experiment("swing", command, path, DT_S)


def test_the_rod_begins_where_the_experiment_does_and_is_held_at_its_end() -> None:
    machine = Pure()
    ran = run_experiment(machine, swing(1.0), RIG, LIMITS, "experiment1")
    assert ran.stopped == ""
    assert ran.record is not None
    assert ran.record.name == "experiment1"
    assert len(ran.record) == 4000
    position = ran.record.column("position_m")
    assert position[0] == pytest.approx(MIDDLE, abs=0.01 * LIMITS.span_m)
    assert machine.position == pytest.approx(position[-1], abs=0.01 * LIMITS.span_m)
    assert abs(machine.sent[-1]) < 0.1


def test_the_guard_ends_what_goes_too_far_and_the_rod_stays_inside() -> None:
    machine = Pure(faster=8.0)
    ran = run_experiment(machine, swing(1.0), RIG, Limits((0.05, 0.2), 10.0), "experiment1")
    assert "comes near the upper end of its travel" in ran.stopped
    assert ran.record is None  # stopped after less than a second
    assert 0.0 < ran.seconds < 1.0
    assert 0.05 < ran.seen.position_m[0] < ran.seen.position_m[1] < 0.2


def test_a_record_without_motion_cannot_be_used() -> None:
    still = Experiment("nothing", np.zeros(4000), np.full(4000, 0.1), DT_S)
    ran = run_experiment(Pure(), still, RIG, LIMITS, "experiment1")
    assert ran.record is None
    assert "is constant" in ran.stopped


def test_no_command_passes_its_limit() -> None:
    machine = Pure()
    run_experiment(machine, swing(1.0), RIG, Limits((0.05, 0.2), 0.7), "experiment1")
    assert max(map(abs, machine.sent)) == pytest.approx(0.7)
