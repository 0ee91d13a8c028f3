# SPDX-License-Identifier: MIT
"""Opens the simulator of a rig file. From here on, a program of the user runs."""

from __future__ import annotations

from ..rigs.simulator_section import SimulatorSection
from .fmu import OpenedFmu
from .python_program import OpenedPython
from .steppers import FmuFunctions, Opened, PythonRecord, PythonSteps, SimulatorError, Stepper

__all__ = [
    "FmuFunctions",
    "Opened",
    "PythonRecord",
    "PythonSteps",
    "SimulatorError",
    "Stepper",
    "open_simulator",
]


def open_simulator(section: SimulatorSection) -> Opened:
    """Loads an FMU, or a class or function of Python, without starting it.

    Raises
    ------
    SimulatorError
        the program cannot be loaded, or something that the section names is missing.
    """
    return OpenedPython(section) if section.fmu is None else OpenedFmu(section)
