# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from gap_rig import RIG

from ehsid.harness.records import make_record
from ehsid.harness.signals.simulation.run import logged_command

TIME = np.arange(100) * 1e-3
VOLTS = np.sin(TIME * 20.0)


def test_a_command_and_its_sampling_time_come_back() -> None:
    volts, dt_s = logged_command(make_record({"time_s": TIME, "command_v": VOLTS}), RIG)
    assert np.array_equal(volts, VOLTS)
    assert dt_s == pytest.approx(1e-3)


def test_commands_that_cannot_drive_a_rig_are_refused() -> None:
    rest = np.delete(np.arange(100), slice(40, 60))
    holes = {"time_s": TIME[rest], "command_v": VOLTS[rest]}
    for columns, says in (
        (holes, "record: a command with gaps"),
        ({"command_v": VOLTS}, "record: a command without time"),
        ({"time_s": TIME, "command_v": 1e3 * VOLTS}, "the command reaches .* is the column in V"),
        ({"time_s": TIME, "valve": VOLTS}, "no column 'command_v'"),
    ):
        with pytest.raises(ValueError, match=says):
            logged_command(make_record(columns), RIG)
