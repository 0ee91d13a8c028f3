# SPDX-License-Identifier: MIT
"""Generator of blind records; it shares no code with the simulator that the diagnosis uses."""

from .batch import write_case
from .case import RealityCase, make_case

__all__ = ["RealityCase", "make_case", "write_case"]
