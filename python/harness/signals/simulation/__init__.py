# SPDX-License-Identifier: MIT
"""Simulates a rig on a command and returns a record: the simulator as the harness uses it.

>>> run = simulate(read_rig("bench.toml"), command, dt_s=1e-3)
>>> run.record.column("position_m")
"""

from .closed_loop import ClosedLoopRun, simulate_closed_loop
from .controller import (
    PositionController,
    command_limit,
    suggested_controller,
    velocity_gain,
    with_integral,
)
from .run import SimulationError, SimulationRun, draw_noise, inside_stroke, simulate
from .settings import parse_settings
from .windows import measured_states

__all__ = [
    "ClosedLoopRun",
    "PositionController",
    "SimulationError",
    "SimulationRun",
    "command_limit",
    "draw_noise",
    "inside_stroke",
    "measured_states",
    "parse_settings",
    "simulate",
    "simulate_closed_loop",
    "suggested_controller",
    "velocity_gain",
    "with_integral",
]
