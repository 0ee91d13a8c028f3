# SPDX-License-Identifier: MIT
"""Result of one injection step, and the notes for the user about it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...base.arrays import FloatArray


class Note(NamedTuple):
    """A sentence about a step; `exact` is False where the step is only approximate."""

    text: str
    exact: bool = True


class Step(NamedTuple):
    """The signal after an injection step, and notes about the step."""

    signal: FloatArray
    notes: list[Note]


def rms(signal: FloatArray) -> float:
    """Root mean square of a signal, in the unit of the signal."""
    return float(np.sqrt(np.mean(np.square(signal))))
