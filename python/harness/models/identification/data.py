# SPDX-License-Identifier: MIT
"""Samples of one input and one output, in segments without gaps.

Exceptions of the identification, one type for each cause that a caller may handle.

Structure of an ARX model: orders and delay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...base.numbers import masked_count
from ...records import Record


class IdentificationError(ValueError):
    """The identification cannot be carried out with these data or settings."""


class TooFewSamplesError(IdentificationError):
    """The record, or one part of it, is too short for the requested orders."""


class UnexcitedError(IdentificationError):
    """The regression matrix is rank-deficient: the data do not determine all parameters.

    Attributes
    ----------
    parameters
        names of the parameters that the data do not determine.
    why
        reason: what the data lack.
    """

    def __init__(self, parameters: tuple[str, ...], why: str) -> None:
        self.parameters = parameters
        self.why = why
        super().__init__(f"the data do not determine {', '.join(parameters)}: {why}")


# A signal that changes by less than this share of its size is constant except for rounding errors,
# and residuals below this share of the output are rounding errors: a regression row is the sum of
# about ten products, each rounded to 1.1e-16, and theta itself is accurate to about 1e-13 at best.
ROUNDING = 1e-12
# Largest |sample|: sums of squares of as many samples as a record may have stay finite, and so do
# the products of parameters and samples.
MOST = 1e100


@dataclass(frozen=True, eq=False)
class IoData:
    """Samples of input u and output y; only the samples inside `segments` are used."""

    u: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    """float64 arrays of shape (n,), finite and at most 1e100 in size."""
    segments: tuple[slice, ...]
    """Slices of consecutive samples, in order, not overlapping."""
    dt_s: float | None = None
    """Sampling time in seconds; None if it is not known."""
    input_name: str = "u"
    output_name: str = "y"
    """Names of the signals in messages and tables."""
    input_unit: str | None = None
    """Unit of the input, where it is not that of the schema: a command in per cent or mA."""

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
            record.own_unit(input_name),
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


@dataclass(frozen=True)
class ArxOrders:
    """Structure of A(q^-1) y(k) = q^-nk B(q^-1) u(k) + e(k), Ghazali et al. 2011, Eq. (7)."""

    na: int
    """Number of output coefficients a1..a_na, at least 1."""
    nb: int
    """Number of input coefficients b1..b_nb, at least 1."""
    nk: int = 1
    """Delay in samples, at least 0; b1 multiplies u(k - nk)."""
    offset: bool = False
    """Whether the model has a constant term."""

    def __post_init__(self) -> None:
        if self.na < 1 or self.nb < 1 or self.nk < 0:
            raise IdentificationError(
                f"na = {self.na}, nb = {self.nb}, nk = {self.nk}: na and nb must be at least 1 "
                "and nk at least 0"
            )

    @property
    def n_parameters(self) -> int:
        """Number of parameters, the length of theta."""
        return self.na + self.nb + int(self.offset)

    @property
    def n_history(self) -> int:
        """Number of samples before k that the regressor of sample k needs."""
        return max(self.na, self.nk + self.nb - 1)

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of theta: a1.., b1.., offset."""
        return (
            *(f"a{i}" for i in range(1, self.na + 1)),
            *(f"b{i}" for i in range(1, self.nb + 1)),
            *(("offset",) if self.offset else ()),
        )

    def __str__(self) -> str:
        equal = f"na = nb = {self.na}"
        orders = equal if self.na == self.nb else f"na = {self.na}, nb = {self.nb}"
        return f"{orders}, nk = {self.nk}" + (", offset" if self.offset else "")
