# SPDX-License-Identifier: MIT
"""Runs of a user's simulator in place of ours, and derivatives of its outputs by differences.

Nothing differentiates a program of others exactly, so that each derivative takes one more run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from ...base.numbers import FloatArray
from ...base.parallel import run_threads
from ...catalogue.spellings import ParameterKey
from ...rigs import Rig
from ...signals.simulation.run import OUTPUTS
from ...simulators.around import FIRST_CATCH_S, Told
from ...simulators.runs import SimulatorRuns
from ..deciding import OF_PRESSURE, SIMULATOR_TOLERANCE
from ..schema import SKIP_S
from .comparison import Compared
from .parameters import Parameter
from .scale import effect_starts

# Steps of x: of a logarithm, of a value with a prior in its deviations, of a size in sizes at which
# a fit starts. Simulators of variable step repeat themselves to about a thousandth.
STEP_LOGARITHM = 0.02
STEP_DEVIATIONS = 0.1
STEP_SIZES = 0.1


class SimulatorEngine:
    """Runs on compared records, which it prepares once each."""

    def __init__(self, runs: SimulatorRuns) -> None:
        self.runs = runs
        section = runs.section
        self.tolerance = section.tolerance or SIMULATOR_TOLERANCE
        self.first_catch_s = SKIP_S if "position_m" in section.start else FIRST_CATCH_S
        self._told: dict[tuple[int, bytes], tuple[Compared, Told]] = {}

    def share(self, name: str) -> float:
        """Share of the motion of an output to which the simulator counts as exact."""
        return self.tolerance * (OF_PRESSURE if "pressure" in name else 1.0)

    def outputs(self, record: Compared, values: FloatArray) -> dict[str, FloatArray]:
        """Outputs by name, shape (N,) each, with each window moved to its measured start."""
        outputs = self.raw(record, values)
        named = {name: outputs[:, column] for column, name in enumerate(OUTPUTS)}
        named["position_m"] = _aligned(named["position_m"], record)
        return named

    def raw(self, record: Compared, values: FloatArray) -> FloatArray:
        """Outputs as the simulator gives them, shape (N, 6)."""
        return self.runs.outputs(self._of(record), values)

    def _of(self, record: Compared) -> Told:
        assert record.caught is not None
        key = id(record.record), record.caught.tobytes()
        if key not in self._told:
            told = Told(
                record.record.column("command_v"),
                record.record.column("position_m"),
                record.caught,
                record.dt_s,
            )
            # The record is kept, so that no other one gets its id.
            self._told[key] = record, told
        return self._told[key][1]


def _aligned(position: FloatArray, record: Compared) -> FloatArray:
    """The position with an offset in each window with which it begins where the machine was."""
    window = record.window
    aligned = position.copy()
    begins = np.flatnonzero((np.diff(window, prepend=-1) != 0) & (window >= 0))
    for begin in begins.tolist():
        inside = slice(begin, begin + int(np.count_nonzero(window == window[begin])))
        aligned[inside] += record.aligned[begin, 0] - position[begin]
    return aligned


def step_of(parameter: Parameter, rig: Rig) -> float:
    """Step of x with which the derivative by a parameter is taken."""
    if parameter.logarithmic:
        return STEP_LOGARITHM
    if np.isfinite(parameter.sigma):
        return STEP_DEVIATIONS * parameter.sigma
    key = ParameterKey(parameter.name)
    assert key.effect is not None
    sizes = [abs(start[key.parameter]) for start in effect_starts(key.effect, rig)]
    return STEP_SIZES * max([size for size in sizes if size > 0.0], default=1e-3)


def differences(
    x: FloatArray,
    varied: Sequence[int],
    parameters: Sequence[Parameter],
    rig: Rig,
    coefficients: Callable[[FloatArray], Mapping[str, FloatArray]],
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Coefficients by output at x, (R,), and their derivatives by the varied x, shape (R, V).

    A parameter that is held has derivatives of zero. coefficients: those at a point.
    """
    steps: list[float] = []
    points = [x]
    for index in varied:
        parameter = parameters[index]
        step = step_of(parameter, rig)
        if parameter.low == parameter.high:
            step = 0.0
        elif x[index] + step > parameter.high:
            step = -step
        steps.append(step)
        if step != 0.0:
            point = x.copy()
            point[index] += step
            points.append(point)
    base, *moved = run_threads([partial(coefficients, point) for point in points])
    slopes = {name: np.zeros((errors.size, len(steps))) for name, errors in base.items()}
    results = iter(moved)
    with np.errstate(over="ignore", invalid="ignore"):
        for column, step in enumerate(steps):
            if step == 0.0:
                continue
            after = next(results)
            for name, errors in base.items():
                slopes[name][:, column] = (after[name] - errors) / step
    return dict(base), slopes
