# SPDX-License-Identifier: MIT
"""What is drawn of the newest samples: never more points than pixels, and no peak is lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.arrays import FloatArray

from .told import COLUMNS

DRAWN = ("position_m", "reference_m", "command_v", "forgetting_factor")
RATE_S = 2.0  # on the wall clock, over which the rate is counted
LEAST_SPAN = 1e-9


@dataclass(frozen=True, eq=False)
class Drawn:
    """Points to draw of m blocks of samples.

    Attributes
    ----------
    time_s, signals
        for each block its minimum and its maximum, shape (2 m,): times, and values by name. Where
        the samples are few, each is a block of its own, and a point: shape (m,).
    at_s, theta, low, high
        ends of the blocks, shape (m,), and for each of n parameters its newest value in the block
        and the bounds of value ± deviation in it; shape (n, m).
    """

    time_s: FloatArray
    signals: dict[str, FloatArray]
    at_s: FloatArray
    theta: FloatArray
    low: FloatArray
    high: FloatArray


def drawn(rows: FloatArray, columns: int) -> Drawn:
    """Returns the points of samples, shape (samples, columns of the ring), for pixel columns."""
    n = (rows.shape[1] - len(COLUMNS)) // 2
    count = len(rows)
    if count == 0:
        empty = np.zeros(0)
        none = np.zeros((n, 0))
        return Drawn(empty, dict.fromkeys(DRAWN, empty), empty, none, none, none)
    few = count <= 2 * columns
    blocks = count if few else columns
    starts = np.unique(np.linspace(0, count, blocks, endpoint=False).astype(np.int64))
    ends = np.append(starts[1:], count) - 1
    time_s = rows[:, 0]
    theta = rows[:, len(COLUMNS) : len(COLUMNS) + n]
    deviation = rows[:, len(COLUMNS) + n :]
    middle = 0.5 * (time_s[starts] + time_s[ends])
    signals = {name: rows[:, COLUMNS.index(name)] for name in DRAWN}
    return Drawn(
        time_s if few else np.stack([time_s[starts], middle], axis=1).ravel(),
        signals if few else {name: _extremes(one, starts) for name, one in signals.items()},
        time_s[ends],
        theta[ends].T.copy(),
        np.fmin.reduceat(theta - deviation, starts, axis=0).T.copy(),
        np.fmax.reduceat(theta + deviation, starts, axis=0).T.copy(),
    )


def _extremes(values: FloatArray, starts: npt.NDArray[np.int64]) -> FloatArray:
    low, high = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
    return np.stack([low, high], axis=1).ravel()


def span(theta: FloatArray, low: FloatArray, high: FloatArray) -> tuple[float, float]:
    """Returns the range of an axis for a parameter and its band, each of shape (m,).

    After a vague start or a reset the first values and deviations are orders of magnitude too
    large; the newer half of the points decides.
    """
    half = theta.size // 2
    values = theta[half:]
    below, above = np.median(values - low[half:]), np.median(high[half:] - values)
    bottom, top = np.quantile(values, [0.02, 0.98])
    bottom, top = float(bottom - 1.5 * below), float(top + 1.5 * above)
    margin = 0.15 * (top - bottom) + LEAST_SPAN * max(1.0, abs(top))
    return bottom - margin, top + margin


def rate(rows: FloatArray) -> float:
    """Returns the samples per second over the last moments; 0 where there are too few."""
    wall_s = rows[:, COLUMNS.index("wall_s")]
    recent = wall_s[wall_s >= wall_s[-1] - RATE_S] if wall_s.size else wall_s
    return float((recent.size - 1) / (recent[-1] - recent[0])) if recent.size > 2 else 0.0
