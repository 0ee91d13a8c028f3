# SPDX-License-Identifier: MIT
"""Samples of one input and one output, in segments without gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...base.arrays import masked_count
from ...records import Record
from .errors import IdentificationError

# A signal that changes by less than this share of its size is constant except for rounding errors,
# and residuals below this share of the output are rounding errors: a regression row is the sum of
# about ten products, each rounded to 1.1e-16, and theta itself is accurate to about 1e-13 at best.
ROUNDING = 1e-12
# Largest |sample|: sums of squares of as many samples as a record may have stay finite, and so do
# the products of parameters and samples.
MOST = 1e100


@dataclass(frozen=True, eq=False)
class IoData:
    """Samples of input u and output y; only the samples inside `segments` are used.

    Attributes
    ----------
    u, y
        float64 arrays of shape (n,), finite and at most 1e100 in size.
    segments
        slices of consecutive samples, in order, not overlapping.
    dt_s
        sampling time in seconds; None if it is not known.
    input_name, output_name
        names of the signals in messages and tables.
    """

    u: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    segments: tuple[slice, ...]
    dt_s: float | None = None
    input_name: str = "u"
    output_name: str = "y"

    def __post_init__(self) -> None:
        for name, values in ((self.input_name, self.u), (self.output_name, self.y)):
            if values.size and not (largest := float(np.abs(values).max())) <= MOST:
                raise IdentificationError(
                    f"{name}: sample {int(np.argmax(np.abs(values)))} is {largest:g} in size: "
                    f"expected at most {MOST:g}, so that squares can be computed; remove the "
                    "sample, or give the signal another unit"
                )

    @classmethod
    def from_arrays(
        cls,
        u: npt.ArrayLike,
        y: npt.ArrayLike,
        *,
        segments: Sequence[slice] | None = None,
        dt_s: float | None = None,
    ) -> IoData:
        """Returns data from two vectors of equal length; without `segments` they are one segment.

        Raises
        ------
        IdentificationError
            input and output are not vectors of equal length, not finite, too large, or partly
            masked.
        """
        if masked_count(u) or masked_count(y):
            raise IdentificationError(
                "input or output have masked values: expected finite numbers throughout; give the "
                "parts without them as segments, or fill them in with filled()"
            )
        u, y = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
        if u.ndim != 1 or u.shape != y.shape:
            raise IdentificationError(
                f"input and output must be vectors of equal length, not {u.shape} and {y.shape}"
            )
        if not (np.isfinite(u).all() and np.isfinite(y).all()):
            raise IdentificationError("input and output must be finite numbers throughout")
        return cls(u, y, tuple(segments) if segments is not None else (slice(0, u.size),), dt_s)

    @classmethod
    def from_record(cls, record: Record, input_name: str, output_name: str) -> IoData:
        """Returns data from two columns of a record, with its segments and sampling time.

        Raises
        ------
        RecordError
            the record has no such column.
        IdentificationError
            a sample is too large.
        """
        return cls(
            record.column(input_name),
            record.column(output_name),
            record.segments,
            record.dt_s,
            input_name,
            output_name,
        )

    @property
    def n_samples(self) -> int:
        """Number of samples inside the segments."""
        return sum(segment.stop - segment.start for segment in self.segments)

    @property
    def index(self) -> npt.NDArray[np.int64]:
        """Numbers of the samples inside the segments, shape (n_samples,)."""
        return np.concatenate([np.arange(s.start, s.stop) for s in self.segments])

    def split(self, fraction: float) -> tuple[IoData, IoData]:
        """Returns the first `fraction` of the samples, 0 < fraction < 1, and the rest.

        Only the segments are divided. Both parts keep the whole arrays, so that a sample number
        means the same sample in both.

        Raises
        ------
        IdentificationError
            the fraction is outside the range.
        """
        if not 0.0 < fraction < 1.0:
            raise IdentificationError(f"the split must lie between 0 and 1, not at {fraction:g}")
        remaining = round(fraction * self.n_samples)
        first: list[slice] = []
        second: list[slice] = []
        for segment in self.segments:
            cut = min(segment.start + remaining, segment.stop)
            remaining -= cut - segment.start
            if cut > segment.start:
                first.append(slice(segment.start, cut))
            if cut < segment.stop:
                second.append(slice(cut, segment.stop))
        return replace(self, segments=tuple(first)), replace(self, segments=tuple(second))
