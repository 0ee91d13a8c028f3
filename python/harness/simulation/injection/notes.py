# SPDX-License-Identifier: MIT
"""What is to be told of a step, beside its result."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ehsid.harness.arrays import FloatArray


class Note(NamedTuple):
    """A sentence; `exact` is False where the step is not what was asked to the last digit."""

    text: str
    exact: bool = True


class Step(NamedTuple):
    """A signal behind a step, and what is to be told of it."""

    signal: FloatArray
    notes: list[Note]


def rms(signal: FloatArray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(signal))))
