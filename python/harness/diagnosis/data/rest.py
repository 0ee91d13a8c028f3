# SPDX-License-Identifier: MIT
"""Stretches of a record in which the rod stands still: changes of the signals there are noise."""

from __future__ import annotations

import numpy as np

from ...base.arrays import FloatArray
from ...records import Record
from ..schema import WINDOW_S

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
