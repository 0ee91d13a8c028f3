# SPDX-License-Identifier: MIT
"""Operating conditions of a servo: a description with its limits, and when each one holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from ...base.arrays import FloatArray
from ...base.plain_number import plain_number
from ...rigs import Rig
from ...signals.simulation import command_limit, measured_states
from ..data.cylinder import areas
from ..data.regimes import NEAR_NULL, SLOW_SHARE
from ..model.comparison import Compared

# Smallest reversals that count, share of the range of the signal, as in `regimes`. AFTER_TURN_S is
# the time after a reversal in which a servo settles: some periods of its oil spring.
TURN_OF_COMMAND = 0.05
TURN_OF_ROD = 0.02
AFTER_TURN_S = 0.1
# Free gas and entrained air have an influence below some five atmospheres.
LOW_PRESSURE_PA = 5e5

BoolArray = npt.NDArray[np.bool_]


def conditions(records: Sequence[Compared], rig: Rig) -> dict[str, BoolArray]:
    """Returns the samples where each condition holds, by its description, record after record.

    Only samples inside windows count. Limits are computed from all records together. Conditions on
    pressures are included only where every record has both.
    """
    states = np.concatenate(
        [measured_states(compared.record)[compared.used] for compared in records]
    )
    command = np.concatenate(
        [compared.record.column("command_v")[compared.used] for compared in records]
    )
    position, speed = states[:, 0], states[:, 1]
    largest = float(np.abs(command).max())
    limit = command_limit(rig)
    null = NEAR_NULL * (limit if np.isfinite(limit) else largest)
    slow = SLOW_SHARE * float(np.abs(speed).max())
    low, high = np.min(position) + np.ptp(position) * np.array([1.0, 2.0]) / 3.0
    holding: dict[str, BoolArray] = {
        f"|command| < {plain_number(null, 3)} V": np.abs(command) < null,
        f"|command| > {plain_number(0.5 * largest, 3)} V": np.abs(command) > 0.5 * largest,
        f"|velocity| < {plain_number(slow, 2)} m/s": np.abs(speed) < slow,
        f"velocity > {plain_number(slow, 2)} m/s": speed > slow,
        f"velocity < {plain_number(-slow, 2)} m/s": speed < -slow,
        f"position < {plain_number(low, 3)} m": position < low,
        f"position {plain_number(low, 3)} to {plain_number(high, 3)} m": (
            (position >= low) & (position <= high)
        ),
        f"position > {plain_number(high, 3)} m": position > high,
    }
    for source, column, share in (
        ("command", "command_v", TURN_OF_COMMAND),
        ("rod", "position_m", TURN_OF_ROD),
    ):
        holding[f"up to {AFTER_TURN_S:g} s after a turn of the {source}"] = np.concatenate(
            [
                after_turns(
                    compared.record.column(column),
                    share,
                    round(AFTER_TURN_S / compared.dt_s),
                )[compared.used]
                for compared in records
            ]
        )
    if rig.plant == "ehs" and not np.isnan(states[:, 2:]).any():
        holding |= _of_pressures(states[:, 2], states[:, 3], rig.values)
    return holding


def _of_pressures(
    a: FloatArray, b: FloatArray, values: Mapping[str, float]
) -> dict[str, BoolArray]:
    cap, annulus = areas(values)
    load = a * cap - b * annulus
    half = 0.5 * float(np.abs(load).max())
    return {
        "load against extension (p_a A_a > p_b A_b)": load > 0.0,
        "load with extension (p_a A_a < p_b A_b)": load < 0.0,
        f"|load| > {plain_number(half, 3)} N": np.abs(load) > half,
        f"a chamber below {LOW_PRESSURE_PA / 1e6:g} MPa": np.minimum(a, b) < LOW_PRESSURE_PA,
    }


def after_turns(signal: FloatArray, share: float, samples: int) -> BoolArray:
    """Marks each turn of a signal and the given number of samples after it, shape (N,).

    A turn is a peak or a trough with a prominence of at least this share of the signal's range.
    """
    least = share * float(np.ptp(signal))
    marks = np.zeros(signal.size)
    if least > 0.0:
        for signed in (signal, -signal):
            marks[find_peaks(signed, prominence=least)[0]] = 1.0
    return np.convolve(marks, np.ones(samples + 1))[: signal.size] > 0.5
