# SPDX-License-Identifier: MIT
"""Rig files as typed data: the description of a machine for the simulator.

>>> rig = read_rig("bench.toml")
>>> rig.values["load.mass_kg"]
120.0
>>> rig.with_values({"effects.coulomb_friction.force_n": 400.0})
"""

from .checks import RigError
from .rig import Rig
from .rig_file import parse_rig, read_rig, rig_text, write_rig

__all__ = ["Rig", "RigError", "parse_rig", "read_rig", "rig_text", "write_rig"]
