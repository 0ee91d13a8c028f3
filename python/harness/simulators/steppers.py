# SPDX-License-Identifier: MIT
"""How an opened simulator is stepped: by C functions, by a Python object, or a record at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray


class SimulatorError(ValueError):
    """A simulator of the user that cannot be opened, or that fails; the message is one line."""

    def __init__(self, what: str, problem: str) -> None:
        self.what = what
        self.problem = " ".join(problem.split())
        super().__init__(f"{what}: {self.problem}")

    def __reduce__(self) -> tuple[type[SimulatorError], tuple[str, str]]:
        return SimulatorError, (self.what, self.problem)


@dataclass(frozen=True)
class FmuFunctions:
    """An instance of an FMU after its initialisation, and the C functions that step it.

    Value of the simulator = scale * SI + offset, for each input and each output.
    """

    major: int
    """Version of FMI, 2 or 3."""
    component: int
    """Address of the instance."""
    set_real: int
    """Address of fmi2SetReal or fmi3SetFloat64."""
    do_step: int
    """Address of fmi2DoStep or fmi3DoStep."""
    get_real: int
    """Address of fmi2GetReal or fmi3GetFloat64."""
    input_refs: npt.NDArray[np.uint32]
    output_refs: npt.NDArray[np.uint32]
    input_scale: FloatArray
    input_offset: FloatArray
    output_scale: FloatArray
    output_offset: FloatArray
    keep: object
    """Keeps the library and the instance alive."""


@dataclass(frozen=True)
class PythonSteps:
    """A Python object at its start."""

    read: Callable[[], Sequence[float]]
    """Returns the outputs as they are, SI, in the order of `Opened.outputs`."""
    step: Callable[[float, Sequence[float]], Sequence[float]]
    """Advances by so many seconds with these inputs held, SI, in the order of `Opened.inputs`, and
    returns the outputs."""


@dataclass(frozen=True)
class PythonRecord:
    """A Python function that simulates a whole record, with its values and its start."""

    run: Callable[[float, Mapping[str, FloatArray]], Mapping[str, FloatArray]]
    """Takes the sampling time, s, and each input by contract name, shape (n,), SI; returns each
    output by contract name, shape (n,), SI."""


Stepper = FmuFunctions | PythonSteps | PythonRecord


class Opened(Protocol):
    """An opened simulator."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """What it takes, by contract names: the command, then the ports in the order of `PORTS`."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """What it returns, by contract names in the order of `OUTPUTS`."""

    @property
    def once_per_process(self) -> bool:
        """Whether a process can have one instance of it only."""

    @property
    def rest(self) -> Mapping[str, float]:
        """Inputs at the start, SI, as the simulator states them; those that it states."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a user should know of it, in whole sentences."""

    def start(self, values: Mapping[str, float], position_m: float | None = None) -> Stepper:
        """Brings the simulator to its start with values by its own names; as often as wanted.

        What an earlier call returned is no longer valid.

        Raises
        ------
        SimulatorError
            it refuses a value, or fails.
        """

    def close(self) -> None:
        """Ends the simulator, and removes what it unpacked."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
