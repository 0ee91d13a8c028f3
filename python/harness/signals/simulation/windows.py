# SPDX-License-Identifier: MIT
"""The windows of a record, and its states, where a simulation of a window begins.

A free run of a servo over the whole record would show only its drift.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter

from ...base.numbers import FloatArray
from ...records import Record

# States that can be set at the start of a window, in the order of `aligned` in ehsid.simulate_plant
STATES = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")

# Over this time the motion of a servo is nearly a cubic polynomial. An oscillation of the oil
# spring at 70 Hz keeps 95 % of its speed, and the sensor noise averages out.
SMOOTHED_S = 0.01
SMOOTHED_ORDER = 3


def window_numbers(
    samples: int, dt_s: float, *, window_s: float, skip_s: float
) -> npt.NDArray[np.int64]:
    """Window number of each sample, shape (samples,); -1 in the first `skip_s` seconds."""
    if not (window_s >= 2.0 * dt_s and 0.0 <= skip_s < samples * dt_s):
        raise ValueError(
            f"window_s = {window_s:g}, skip_s = {skip_s:g}: expected windows of at least two "
            f"samples ({2.0 * dt_s:g} s) and a start within the record ({samples * dt_s:g} s)"
        )
    length, skipped = round(window_s / dt_s), math.ceil(skip_s / dt_s * (1.0 - 1e-12))
    return np.maximum((np.arange(samples) - skipped) // length, -1)


def measured_states(record: Record) -> FloatArray:
    """Returns the states that a record gives, in the order of STATES; NaN for a missing column.

    The result has the shape (N, 4). The position and the pressures are those of the record. So is
    the speed where it was measured; otherwise it is the slope of a cubic fitted to the position
    over 10 ms around the sample (Savitzky, Golay, Anal. Chem. 36(8), 1964).
    """
    dt_s = record.dt_s
    if dt_s is None or len(record.segments) > 1:
        raise ValueError(
            f"{record.source or record.name}: windows need one stretch with a sampling time; cut "
            "the record at its gaps"
        )
    states = np.full((len(record), len(STATES)), np.nan)
    for i, name in enumerate(STATES):
        if name in record.columns:
            states[:, i] = record.column(name)
    if "velocity_m_s" not in record.columns:
        length = min(max(5, 2 * round(0.5 * SMOOTHED_S / dt_s) + 1), len(record) - 1 | 1)
        states[:, 1] = savgol_filter(
            record.column("position_m"), length, polyorder=SMOOTHED_ORDER, deriv=1, delta=dt_s
        )
    return states
