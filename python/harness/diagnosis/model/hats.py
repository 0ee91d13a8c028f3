# SPDX-License-Identifier: MIT
"""Unknown inputs of an equation as sums of hat functions inside the windows of a record.

A hat is one at its node and falls to zero at the two next ones; beyond the outer nodes of a window
it stays. Their sum is one: an input is linear between nodes. The windows follow each other, and a
hat in one of them acts on the next one only through the state that is carried over. Hats at the
same place of all windows of even number therefore are one direction of the simulator, and those of
odd number another one: two runs' worth of derivatives give the response of every window to its own
hats.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray
from .comparison import Compared

# Distance of the nodes, s: unknown inputs up to 25 Hz. Slowly sampled records have fewer.
SPACING_S = 0.02
LEAST_SAMPLES = 2
LEAST_HATS = 3


@dataclass(frozen=True, eq=False)
class Hats:
    """The hat functions of a record with W windows of L samples.

    Attributes
    ----------
    begins
        first sample of each window, shape (W,).
    shapes
        the n hats of a window, shape (n, L).
    spacing_s
        distance of the nodes, s.
    samples
        number of samples of the record.
    """

    begins: npt.NDArray[np.int64]
    shapes: FloatArray
    spacing_s: float
    samples: int

    @property
    def count(self) -> int:
        """Number n of the hats of a window."""
        return int(self.shapes.shape[0])

    def signals(self) -> FloatArray:
        """The 2 n directions, those of the windows of even number first, shape (2 n, samples)."""
        signals = np.zeros((2 * self.count, self.samples))
        for number, begin in enumerate(self.begins.tolist()):
            first = (number % 2) * self.count
            signals[first : first + self.count, begin : begin + self.shapes.shape[1]] = self.shapes
        return signals

    def own(self, by_direction: FloatArray) -> FloatArray:
        """Of what each window shows for all directions, (W, ..., 2 n), its own, (W, ..., n)."""
        own = np.array(by_direction[..., : self.count])
        own[1::2] = by_direction[1::2, ..., self.count : 2 * self.count]
        return own

    def at_nodes(self, signal: FloatArray) -> FloatArray:
        """Means of a signal (samples, ...) over each hat, shape (W, n, ...)."""
        weights = self.shapes / self.shapes.sum(axis=1, keepdims=True)
        length = self.shapes.shape[1]
        windows = np.stack([signal[b : b + length] for b in self.begins.tolist()])
        return np.asarray(np.einsum("nl,wl...->wn...", weights, windows, optimize=True))


def hats(record: Compared) -> Hats:
    """The hat functions of the full windows of a record."""
    windows, length = record.full_windows
    most = max(LEAST_HATS, length // LEAST_SAMPLES)
    count = min(max(round(length * record.dt_s / SPACING_S), LEAST_HATS), most)
    place = np.clip((np.arange(length) + 0.5) * count / length - 0.5, 0.0, count - 1.0)
    shapes = np.maximum(1.0 - np.abs(place - np.arange(count)[:, np.newaxis]), 0.0)
    samples = np.flatnonzero(record.used)
    number = record.window[samples]
    begins = samples[np.flatnonzero(np.diff(number, prepend=-1))][:windows]
    return Hats(begins, shapes, length * record.dt_s / count, len(record.record))
