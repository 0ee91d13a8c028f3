# SPDX-License-Identifier: MIT
"""Few points of a long signal that look as all of them do: minimum and maximum of every column.

A signal is stored with the extremes of its blocks of 64 samples, of 64 of these blocks, and so on.
A view then reads a few thousand numbers, however long the signal is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ehsid.harness.base.numbers import FloatArray

FACTOR = 64


@dataclass(frozen=True, eq=False)
class Pyramid:
    """A signal and the extremes of its blocks."""

    values: FloatArray
    """The signal, shape (n,); NaN where a value is missing."""
    levels: tuple[FloatArray, ...]
    """For each level k = 1, 2, ... minima and maxima of the blocks of FACTOR^k samples, shape (2,
    number of whole blocks)."""

    def view(self, first: int, last: int, columns: int) -> tuple[FloatArray, FloatArray]:
        """Returns positions and values of the points to draw for the samples first to last - 1.

        Parameters
        ----------
        first, last
            range of samples; what lies outside of the signal is left out.
        columns
            number of pixel columns; each gets its minimum and its maximum.

        Returns
        -------
        Positions in samples, and values, both of shape (m,) with m at most 4 `columns`.
        """
        first, last = max(0, first), min(self.values.size, last)
        count = last - first
        if count <= 4 * columns:
            return np.arange(first, max(first, last), dtype=np.float64), np.asarray(
                self.values[first:last], dtype=np.float64
            )
        low, high, begins = self._blocks(first, last, count // columns)
        starts = np.unique(np.linspace(0, low.size, columns, endpoint=False).astype(np.int64))
        lows, highs = np.fmin.reduceat(low, starts), np.fmax.reduceat(high, starts)
        at = begins[starts]
        middle = 0.5 * (at + np.append(at[1:], last))
        return _alternating(at, middle), _alternating(lows, highs)

    def _blocks(
        self, first: int, last: int, stretch: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Minima, maxima and first samples of blocks that are not longer than a stretch."""
        size, level = 1, 0
        while level < len(self.levels) and FACTOR * size <= stretch:
            size, level = FACTOR * size, level + 1
        begin, end = -(-first // size), last // size
        if level == 0 or end <= begin:
            values = np.asarray(self.values[first:last])
            return values, values, np.arange(first, last, dtype=np.float64)
        # The ends of the view are parts of blocks, whose extremes come from the samples.
        head = self.values[first : begin * size]
        tail = self.values[end * size : last]
        middle = np.asarray(self.levels[level - 1][:, begin:end])
        low = np.concatenate([_extreme(np.fmin, head), middle[0], _extreme(np.fmin, tail)])
        high = np.concatenate([_extreme(np.fmax, head), middle[1], _extreme(np.fmax, tail)])
        begins = size * np.arange(begin, end, dtype=np.float64)
        ends = [[float(first)] if head.size else [], [float(end * size)] if tail.size else []]
        return low, high, np.concatenate([ends[0], begins, ends[1]])


def _extreme(of: np.ufunc, values: FloatArray) -> FloatArray:
    return np.array([of.reduce(values)]) if values.size else np.zeros(0)


def _alternating(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.stack([first, second], axis=1).ravel()


def make_pyramid(values: FloatArray) -> Pyramid:
    """Returns the pyramid of a signal, shape (n,)."""
    levels: list[FloatArray] = []
    low = high = values
    while low.size >= FACTOR:
        whole = low.size // FACTOR * FACTOR
        low = np.fmin.reduce(low[:whole].reshape(-1, FACTOR), axis=1)
        high = np.fmax.reduce(high[:whole].reshape(-1, FACTOR), axis=1)
        levels.append(np.stack([low, high]))
    return Pyramid(values, tuple(levels))


def store(pyramid: Pyramid, folder: Path, key: str) -> None:
    """Writes a pyramid into a folder, to be opened without reading it."""
    for number, level in enumerate((pyramid.values, *pyramid.levels)):
        # A page may draw from the earlier file, which has to stay whole as long as it is open.
        new = folder / f"{key}.new.npy"
        np.save(new, level)
        new.replace(folder / f"{key}.{number}.npy")


def opened(folder: Path, key: str) -> Pyramid:
    """Returns a stored pyramid whose numbers stay in the files until they are drawn.

    Raises
    ------
    OSError
        there is no such pyramid.
    """
    pattern = re.compile(re.escape(key) + r"\.([1-9][0-9]?)\.npy")
    numbers = sorted(int(m[1]) for path in folder.iterdir() if (m := pattern.fullmatch(path.name)))
    return Pyramid(
        np.load(folder / f"{key}.0.npy", mmap_mode="r"),
        tuple(np.load(folder / f"{key}.{number}.npy", mmap_mode="r") for number in numbers),
    )
