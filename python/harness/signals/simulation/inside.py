# SPDX-License-Identifier: MIT
"""Makes a command so small that the rod stays inside its stroke."""

from __future__ import annotations

import numpy as np

from ...base.arrays import FloatArray
from ...rigs import Rig
from ..excitation import travel
from .controller import velocity_gain

# Of the way to an end of the stroke: the speed differs between the directions.
USED = 0.7


def inside_stroke(rig: Rig, command_v: FloatArray, dt_s: float) -> FloatArray:
    """Returns the command less its mean, and so small that the rod stays inside, V, shape (N,).

    `excitation.fit_to_travel` refuses a command that is too large; this is for those who choose a
    size by eye.

    Parameters
    ----------
    rig
        the machine, which starts at mid-stroke; one without a stroke leaves the command as it is.
    command_v
        the command as wished, V, shape (N,).
    dt_s
        sampling time in seconds.
    """
    stroke = rig.values.get("cylinder.stroke_m")
    if stroke is None:
        return command_v
    centred = np.asarray(command_v - np.mean(command_v), dtype=np.float64)
    start = 0.5 * stroke
    low, high = travel(centred, dt_s, velocity_gain(rig), start)
    farthest = max(start - low, high - start)
    return centred * min(1.0, USED * start / max(farthest, 1e-12))
