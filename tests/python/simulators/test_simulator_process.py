# SPDX-License-Identifier: MIT
"""A simulator that crashes, hangs or takes too much memory ends a run, and nothing else."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from user_simulators import FOLDER, needs_linux64

from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.harness.rigs import read_rig
from ehsid.harness.rigs.simulator_section import Signal, SimulatorSection, SimulatorValue
from ehsid.harness.simulators.around import Around, Told
from ehsid.harness.simulators.process import Failed, SimulatorProcess
from ehsid.harness.simulators.runs import opened_runs
from ehsid.harness.simulators.steppers import SimulatorError

# At 'fault' it does what a program of others may do; else it moves by the command.
PROGRAM = """
import ctypes, time

class Faulty:
    inputs, outputs = ("command_v",), ("position_m",)
    parameters = dict(fault=0.0)

    def reset(self, parameters=None, position_m=0.0):
        self.fault, self.y = (parameters or {}).get("fault", 0.0), position_m
        return (self.y,)

    def step(self, dt, command_v):
        if self.fault == 1.0:
            ctypes.string_at(0)
        if self.fault == 2.0:
            time.sleep(1e6)
        if self.fault == 3.0:
            self.kept = bytearray(2**40)
        if self.fault == 4.0:
            raise RuntimeError("no oil")
        self.y += 0.03 * dt * command_v
        return (self.y,)
"""


def section(folder: Path) -> SimulatorSection:
    (folder / "faulty.py").write_text(PROGRAM, encoding="utf-8")
    return SimulatorSection(
        python="faulty.py:Faulty",
        base=folder,
        inputs={"command_v": Signal("command_v")},
        outputs={"position_m": Signal("position_m")},
        start={"position_m": Signal("position_m")},
        parameters={"fault": SimulatorValue(0.0, 1.0)},
    )


def told() -> Told:
    ones = np.ones(50)
    return Told(ones, np.zeros(50), np.zeros(50, np.uint8), 1e-3)


def around(fault: float) -> Around:
    values = np.array([plant_parameters()[name].typical for name in plant_parameters()])
    for k, name in enumerate(plant_parameters()):
        if name.startswith("effects."):
            values[k] = 0.0
    return Around(values, {"fault": fault}, 0.1)


@pytest.mark.parametrize(
    ("fault", "says"),
    [(1.0, "crashed its process (signal"), (2.0, "longer than 3 s")],
)
def test_a_fault_ends_one_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: float, says: str
) -> None:
    monkeypatch.setenv("EHSID_MAX_SIMULATOR_S", "3")
    process = SimulatorProcess(section(tmp_path))
    record = told()
    try:
        failed = process.run(record, around(fault))
        assert isinstance(failed, Failed)
        assert says in failed.message
        again = process.run(record, around(0.0))
        assert isinstance(again, np.ndarray)
        assert again[-1, 0] == pytest.approx(0.1 + 49 * 0.03 * 1e-3)
    finally:
        process.close()


@pytest.mark.parametrize(("fault", "says"), [(3.0, "MemoryError"), (4.0, "no oil")])
def test_what_the_program_raises_is_one_line(tmp_path: Path, fault: float, says: str) -> None:
    process = SimulatorProcess(section(tmp_path))
    try:
        with pytest.raises(SimulatorError, match=rf"faulty\.py: \w*{says}|{says}") as raised:
            process.run(told(), around(fault))
        assert "\n" not in str(raised.value)
    finally:
        process.close()


@needs_linux64
def test_processes_and_folders_are_gone_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with opened_runs(read_rig(FOLDER / "rig.toml")) as runs:
        assert list(tmp_path.glob("ehsid-*"))
        processes = [runner._process for runner in runs._runners]  # type: ignore[union-attr]
    assert not list(tmp_path.glob("ehsid-*"))
    assert all(each is None or each.poll() is not None for each in processes)


def test_a_simulator_that_does_not_move_is_said(tmp_path: Path) -> None:
    (tmp_path / "still.py").write_text(
        PROGRAM.replace("0.03 * dt * command_v", "0.0").replace("Faulty", "Still"), "utf-8"
    )
    (tmp_path / "rig.toml").write_text(
        'name = "still"\nplant = "simulator"\n[valve]\nrated_command_v = 10.0\n'
        '[simulator]\npython = "still.py:Still"\n[simulator.inputs]\ncommand_v = "command_v"\n'
        '[simulator.outputs]\nposition_m = "position_m"\n',
        encoding="utf-8",
    )
    with (
        pytest.raises(SimulatorError, match="does not move the position"),
        opened_runs(read_rig(tmp_path / "rig.toml")),
    ):
        pass
