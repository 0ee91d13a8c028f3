# SPDX-License-Identifier: MIT
"""Repeats of the command in a record: the difference of the responses to them is noise.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, sec.
2.5: the sample variance over periods needs no model of the plant.

Stretches of a record in which the rod stands still: changes of the signals there are noise.

What follows from the values of a cylinder and its valve: areas, full speed, oil spring.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...records import Record
from ...rigs import Rig
from ..schema import WINDOW_S

# The response of a servo no longer depends on its past after a few periods of its oil spring; a
# valve settles sooner.
REPEAT_SETTLED_S = 0.5
# Between two repeats the rod may move away by this share of its range within one repeat. The
# volumes, and with them the oil spring, then differ by less than that share, and the response by
# less than half of it.
REPEAT_DRIFT = 0.02
# The same where three repeats are combined so that an even drift cancels. A drift of half of the
# range leaves less than its square.
REPEAT_DRIFT_EVEN = 0.5

# Length of the pieces of command (words) that are searched for. A word of this length with several
# different values does not repeat by chance.
WORD = 24
# Number of positions at which words begin. A repeat of a twentieth of the record is detected.
ANCHORS = 40


@dataclass(frozen=True)
class Repeat:
    """Samples `first` to `last` (excluded), whose command repeats exactly `lag` samples later."""

    lag: int
    first: int
    last: int


def find_repeat(command: FloatArray, least: int) -> Repeat | None:
    """Finds the longest stretch whose command repeats exactly; None if it is below `least`.

    Commands that a controller computed from a noisy sensor never repeat exactly.

    Parameters
    ----------
    command
        shape (N,).
    least
        number of samples that the stretch must have.
    """
    n = command.size
    longest: Repeat | None = None
    tried_lags: set[int] = set()
    for anchor in np.linspace(0, max(0, n - 2 * WORD), ANCHORS).astype(int).tolist():
        word = command[anchor : anchor + WORD]
        # A word with few different values occurs everywhere.
        if np.unique(word).size < WORD // 4:
            continue
        rest = command[anchor + 1 :]
        places = np.flatnonzero(rest[: rest.size - WORD + 1] == word[0])
        for offset in range(1, WORD):
            places = places[rest[places + offset] == word[offset]]
        for lag in (places[:2] + 1).tolist():
            if lag in tried_lags:
                continue
            tried_lags.add(lag)
            first, last = _longest(command[lag:] == command[:-lag])
            if last - first >= least and (
                longest is None or last - first > longest.last - longest.first
            ):
                longest = Repeat(lag, first, last)
    return longest


def _longest(same: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """Finds the longest run of True; returns its first index and its end, which is excluded."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    if starts.size == 0:
        return 0, 0
    index = int(np.argmax(ends - starts))
    return int(starts[index]), int(ends[index])


def repeat_errors(record: Record, name: str) -> list[FloatArray]:
    """Differences of a column between repeats, in windows, scaled to the deviation of the noise.

    With three repeats in a row the difference is x_1 - 2 x_2 + x_3, with six times the variance of
    the noise; an even change from repeat to repeat, as from a drift of the rod, cancels. With two
    it is x_1 - x_2, with twice the variance, and is used only if the rod stays in place. The mean
    of each window is subtracted, because a servo drifts and the gap is measured in windows.

    Parameters
    ----------
    record
        without gaps, with `command_v` and `position_m`.
    name
        name of the column.

    Returns
    -------
    Windows of equal length, in the unit of the column; an empty list if the command does not repeat
    or the rod drifts too much.
    """
    assert record.dt_s is not None
    length = max(10, round(WINDOW_S / record.dt_s))
    settled = round(REPEAT_SETTLED_S / record.dt_s)
    repeat = find_repeat(record.column("command_v"), settled + 2 * length)
    if repeat is None:
        return []
    begin = repeat.first + settled
    # If the stretch is longer than a period, the third repeat begins within it.
    samples = repeat.last - repeat.lag - begin
    weights, largest_drift = np.array([1.0, -2.0, 1.0]), REPEAT_DRIFT_EVEN
    if samples < 2 * length:
        samples, weights, largest_drift = repeat.last - begin, np.array([1.0, -1.0]), REPEAT_DRIFT

    def repeats(column: FloatArray) -> FloatArray:
        starts = begin + repeat.lag * np.arange(weights.size)
        return np.stack([column[start : start + samples] for start in starts])

    position = repeats(record.column("position_m"))
    drift = np.abs(np.diff(position.mean(axis=1))).max()
    if drift > largest_drift * np.ptp(position, axis=1).max():
        return []
    difference = weights @ repeats(record.column(name)) / np.linalg.norm(weights)
    count = samples // length
    windows = difference[: count * length].reshape(count, length)
    centred = windows - windows.mean(axis=1, keepdims=True)
    # The subtraction of the mean takes one degree of freedom.
    return list(centred * np.sqrt(length / (length - 1)))


# Limits of a rest. A command that stays within a two-hundredth of its range moves the rod by less
# than friction holds. A hundredth of the largest speed is creep, which is nearly a straight line.
REST_COMMAND = 0.005
REST_SPEED = 0.01


def rest_windows(record: Record) -> list[slice]:
    """Finds windows at rest, each after a window in which the command already stood still.

    At rest the command varies by at most REST_COMMAND of its range in the record, and the mean
    speed is at most REST_SPEED of the largest mean speed of a window.

    Parameters
    ----------
    record
        without gaps, with `command_v` and `position_m`.
    """
    assert record.dt_s is not None
    length = max(10, round(WINDOW_S / record.dt_s))
    count = len(record) // length
    if count < 2:
        return []
    command = record.column("command_v")[: count * length].reshape(count, length)
    position = record.column("position_m")[: count * length].reshape(count, length)
    command_still = np.ptp(command, axis=1) <= REST_COMMAND * np.ptp(command)
    third = length // 3
    ends = position[:, -third:].mean(axis=1), position[:, :third].mean(axis=1)
    travelled = np.abs(ends[0] - ends[1])
    rod_still = travelled <= REST_SPEED * travelled.max()
    settled = np.concatenate([[False], command_still[:-1]])
    return [
        slice(k * length, (k + 1) * length)
        for k in np.flatnonzero(command_still & rod_still & settled).tolist()
    ]


def rest_errors(record: Record, name: str) -> list[FloatArray]:
    """Returns a column in the windows at rest, less a straight line in each: creep is no noise."""
    column = record.column(name)
    errors = []
    for window in rest_windows(record):
        samples = column[window]
        time = np.linspace(-1.0, 1.0, samples.size)
        line = samples.mean() + time * (time @ samples) / (time @ time)
        # The subtraction of the line takes two degrees of freedom.
        errors.append((samples - line) * np.sqrt(samples.size / (samples.size - 2)))
    return errors


def areas(values: Mapping[str, float]) -> tuple[float, float]:
    """Areas of the piston on the cap side and on the rod side, m^2."""
    cap = 0.25 * math.pi * values["cylinder.bore_m"] ** 2
    return cap, cap - 0.25 * math.pi * values["cylinder.rod_m"] ** 2


def full_speed(values: Mapping[str, float]) -> float:
    """Speed of the rod with a fully open valve and without load, m/s."""
    # Without load about half of the pressure is lost at each metering edge.
    drop = 0.5 * (values["supply.pressure_pa"] - values["supply.tank_pressure_pa"])
    flow = values["valve.rated_flow_m3_s"] * math.sqrt(
        drop / values["valve.rated_pressure_drop_pa"]
    )
    return flow / (0.25 * math.pi * values["cylinder.bore_m"] ** 2)


def oil_spring_hz(rig: Rig) -> float | None:
    """Natural frequency of the load on the oil at mid-stroke, Hz; None for a plant without oil.

    That of a user's simulator is not known either.
    """
    v = rig.values
    if rig.plant in ("axis", "simulator"):
        return None
    if rig.plant == "linear":
        # omega^2 = 4 beta_e A_p^2 / (V_t M_t) (H. Merritt, Hydraulic Control Systems, 1967)
        square = 4.0 * v["linear.bulk_modulus_pa"] * v["linear.area_m2"] ** 2
        square /= v["linear.volume_m3"] * v["linear.mass_kg"]
        return math.sqrt(square) / (2.0 * math.pi)
    cap, annulus = areas(v)
    half = 0.5 * v["cylinder.stroke_m"]
    # omega^2 = beta (A_a^2 / V_a + A_b^2 / V_b) / m: the two chambers are springs side by side.
    stiffness = v["fluid.bulk_modulus_pa"] * (
        cap**2 / (v["cylinder.dead_volume_a_m3"] + cap * half)
        + annulus**2 / (v["cylinder.dead_volume_b_m3"] + annulus * half)
    )
    return math.sqrt(stiffness / v["load.mass_kg"]) / (2.0 * math.pi)
