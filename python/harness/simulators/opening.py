# SPDX-License-Identifier: MIT
"""Opens the simulator of a rig file. From here on, a program of the user runs."""

from __future__ import annotations

from pathlib import Path

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


def open_simulator(section: SimulatorSection, folder: Path | None = None) -> Opened:
    """Loads an FMU, or a class or function of Python, without starting it.

    Parameters
    ----------
    section
        the simulator.
    folder
        where an FMU is unpacked, in a new folder there, which `Opened.close` removes. A process
        that ends otherwise leaves it behind, so that its parent should name a folder of its own.
        None is the folder of the system for temporary files.

    Raises
    ------
    SimulatorError
        the program cannot be loaded, or something that the section names is missing.
    """
    return OpenedPython(section) if section.fmu is None else OpenedFmu(section, folder)
