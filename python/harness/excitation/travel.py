# SPDX-License-Identifier: MIT
"""Whether a plant whose velocity follows the command stays inside its stroke.

The plant is taken as an integrator, y' = gain u, with the command held between samples. Lag,
unequal areas and load are left out: leave a margin, and let `simulate` have the last word.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ehsid.harness.excitation.excitation import check_samples


def travel(
    command: npt.NDArray[np.float64], dt_s: float, gain_m_s_v: float, start_m: float
) -> tuple[float, float]:
    """Lowest and highest position, the start and the end of the last interval included.

    Parameters
    ----------
    command
        shape (n,), n >= 1, finite, in volts.
    dt_s
        sampling time in seconds, > 0.
    gain_m_s_v
        velocity per volt, finite, of either sign.
    start_m
        position at the first sample.
    """
    if not 0.0 < dt_s < np.inf:
        raise ValueError(f"travel: dt_s = {dt_s:g}: expected a finite dt_s > 0")
    for name, value in (("gain_m_s_v", gain_m_s_v), ("start_m", start_m)):
        if not math.isfinite(value):
            raise ValueError(f"travel: {name} = {value:g}: expected a finite number")
    check_samples("travel", command)
    # y_{k+1} = y_k + gain dt u_k; straight lines between, so the corners are the extremes.
    position = start_m + gain_m_s_v * dt_s * np.cumsum(command)
    return min(start_m, float(position.min())), max(start_m, float(position.max()))


def fit_to_travel(
    command: npt.NDArray[np.float64],
    dt_s: float,
    *,
    gain_m_s_v: float,
    start_m: float,
    stroke_m: float,
) -> npt.NDArray[np.float64]:
    """The command itself where it stays inside 0 to stroke_m, else the command less its mean.

    Less its mean it ends where it began; its peak may have grown by the mean. It is not made
    smaller: that would be another test.

    Parameters
    ----------
    command, dt_s, gain_m_s_v
        as in `travel`.
    start_m
        0 <= start_m <= stroke_m.
    stroke_m
        > 0.

    Returns
    -------
    shape (n,), a new array.

    Raises
    ------
    ValueError
        an argument outside its range, or a command that leaves the stroke without its mean, too;
        the message says which scale and start would fit.
    """
    if not 0.0 < stroke_m < np.inf:
        raise ValueError(f"fit_to_travel: stroke_m = {stroke_m:g}: expected a finite stroke_m > 0")
    if not 0.0 <= start_m <= stroke_m:
        raise ValueError(
            f"fit_to_travel: start_m = {start_m:g}: expected 0 <= start_m <= {stroke_m:g}"
        )
    low, high = travel(command, dt_s, gain_m_s_v, start_m)
    if low >= 0.0 and high <= stroke_m:
        return np.array(command, dtype=np.float64)
    centred = np.asarray(command - np.mean(command), dtype=np.float64)
    low, high = travel(centred, dt_s, gain_m_s_v, start_m)
    if low >= 0.0 and high <= stroke_m:
        return centred
    down, up = start_m - low, high - start_m
    room = stroke_m - start_m
    # From the best start the command has the whole stroke; the thousandth is for rounding in print.
    there = min(1.0, 0.999 * stroke_m / (down + up))
    remedy = f"start at {0.5 * (stroke_m + there * (down - up)):.5g} m"
    if there < 1.0:
        remedy += f" and scale it by at most {there:.5g}"
    if 0.0 < start_m < stroke_m:
        here = 0.999 * min(start_m / max(down, start_m), room / max(up, room))
        remedy = f"scale it by at most {here:.5g}, or {remedy}"
    raise ValueError(
        f"fit_to_travel: less its mean, the command still moves from {low:.4g} to {high:.4g} m, "
        f"beyond 0 to {stroke_m:g} m: {remedy}"
    )
