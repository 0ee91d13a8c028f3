# SPDX-License-Identifier: MIT
"""The newest samples of a run in a file of fixed size: one process writes, any number reads.

The first row holds the number of samples that were written so far. A sample is written before the
number counts it. Readers use the newer half of the rows only, so that the writer does not overtake
them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.arrays import FloatArray

ROWS = 65536


class RingWriter:
    """Writes samples of a fixed number of columns."""

    def __init__(self, path: Path, columns: int, rows: int = ROWS) -> None:
        shape = (rows + 1, columns)
        # Whole under its name at once: a reader may look between the header and the rows.
        aside = path.with_name(f".{path.name}.part")
        self._file = np.lib.format.open_memmap(aside, mode="w+", dtype=np.float64, shape=shape)
        aside.replace(path)
        self._rows = rows
        self._count = 0

    def add(self, sample: npt.ArrayLike) -> None:
        """Adds a sample in the place of the oldest one."""
        self._file[1 + self._count % self._rows] = sample
        self._count += 1
        self._file[0, 0] = self._count


class RingReader:
    """Reads the newest samples."""

    def __init__(self, path: Path) -> None:
        self._file = np.load(path, mmap_mode="r")

    @property
    def count(self) -> int:
        """Number of samples that were written so far."""
        return int(self._file[0, 0])

    def newest(self, samples: int) -> FloatArray:
        """Returns at most this many of the newest samples, the oldest in front."""
        rows, count = len(self._file) - 1, self.count
        samples = min(samples, count, max(1, rows // 2))
        places = np.arange(count - samples, count) % rows
        return np.asarray(self._file[1 + places])
