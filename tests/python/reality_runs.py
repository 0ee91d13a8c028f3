# SPDX-License-Identifier: MIT
"""Runs of the blind machine without noise, for tests."""

import numpy as np
import numpy.typing as npt

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
