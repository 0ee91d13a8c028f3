# SPDX-License-Identifier: MIT
"""Repeats of the command in a record: the difference of the responses to them is noise.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, sec.
2.5: the sample variance over periods needs no model of the plant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray
from ...records import Record
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
