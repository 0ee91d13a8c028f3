# SPDX-License-Identifier: MIT
"""Blind machines that are only drawn, and their runs without noise, for tests."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from ehsid.lab.reality import RealityCase, make_case
from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.truth import Truth

FloatArray = npt.NDArray[np.float64]
DT_S = 1e-3


def own_run(t: Truth, start: FloatArray, commands: FloatArray, fine: int = 2) -> FloatArray:
    n = commands.size + 1
    commands = np.append(commands, 0.0)
    quiet = np.zeros(n)
    _, out = equations.run(
        t._replace(sensor_step_m=1e-12),
        start,
        DT_S,
        commands,
        quiet,
        0.0,
        1e-12,
        quiet,
        quiet,
        np.zeros(n, dtype=np.bool_),
        fine,
    )
    return out


def drawn_case(*arguments: Any, **options: Any) -> RealityCase:
    """A case for tests of its rig, machine and answer: its machine is not run."""

    def stands(t: Truth, start: FloatArray, dt_s: float, forward: FloatArray, *_: Any) -> Any:
        return np.zeros(forward.size), np.zeros((forward.size, 6))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(equations, "run", stands)
        return make_case(*arguments, seconds=0.01, **options)
