# SPDX-License-Identifier: MIT
"""A machine behind a target: what the target answers is what acts."""

from __future__ import annotations

import numpy as np
import pytest
from gap_rig import RIG
from hil_runs import PATIENT, TIMEOUT_S
from hil_target import FakeDevice, Target

from ehsid.harness.diagnosis.limits import Limits
from ehsid.harness.hunt.machines import SimulatedMachine, machine_of
from ehsid.harness.hunt.running import Experiment, run_experiment
from ehsid.hil.faults import relayed
from ehsid.hil.machine import TargetMachine
from ehsid.hil.session import Session
from ehsid.hil.transport import open_line

DT_S = 0.02
LIMITS = Limits((0.02, 0.28), 10.0)


def swing() -> Experiment:
    command = 2.0 * np.sin(2.0 * np.pi * np.arange(200) * DT_S)
    return Experiment("swing", command, np.full(200, 0.15), DT_S)


@pytest.mark.slow
def test_a_hunt_runs_through_a_target_as_without_one() -> None:
    direct = SimulatedMachine(RIG, ("position_m",), dt_s=DT_S, seed=1)
    expected = run_experiment(direct, swing(), RIG, LIMITS, "experiment1").record
    target = Target()
    behind = SimulatedMachine(RIG, ("position_m",), dt_s=DT_S, seed=1)
    with relayed(FakeDevice(target)) as relay, open_line(relay.port) as line:
        session = Session(line, timeout_s=TIMEOUT_S, attempts=PATIENT)
        machine = TargetMachine(behind, session, RIG, dt_s=DT_S)
        assert machine_of(machine, dt_s=DT_S, seed=1) is machine
        found = run_experiment(machine, swing(), RIG, LIMITS, "experiment1").record
    assert found is not None
    assert expected is not None
    # Each sample went to the target once, in order: approach, experiment and rest.
    assert target.carried_out == list(range(len(target.carried_out)))
    assert len(target.carried_out) > 200
    # The line carries float32: commands and positions are rounded to 6e-8 of their size.
    np.testing.assert_allclose(
        found.column("position_m"), expected.column("position_m"), rtol=0.0, atol=1e-6
    )
