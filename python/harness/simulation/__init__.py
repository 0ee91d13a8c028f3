# SPDX-License-Identifier: MIT
"""The simulator as the harness uses it: a rig and a command become a record.

>>> run = simulate(read_rig("bench.toml"), command, dt_s=1e-3)
>>> run.record.column("position_m")
"""

from ehsid.harness.simulation.run import SimulationError, SimulationRun, simulate
from ehsid.harness.simulation.settings import parse_settings

__all__ = ["SimulationError", "SimulationRun", "parse_settings", "simulate"]
