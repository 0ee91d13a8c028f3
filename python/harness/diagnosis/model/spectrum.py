# SPDX-License-Identifier: MIT
"""Errors of the windows of records by frequency, and their likelihood.

The errors e_0 ... e_(N-1) of a window are replaced by their discrete cosine transform, type II,

    c_k = sqrt(2 / N) sum_t e_t cos(pi k (t + 1/2) / N),  k > 0;  c_0 = sum_t e_t / sqrt(N)

which is orthonormal: white noise keeps its variance in each coefficient. The coefficients of a
coloured disturbance are nearly independent of each other (N. Ahmed, T. Natarajan, K. R. Rao, IEEE
Trans. Computers C-23(1), 1974), unlike its samples. A window may start and end at any value; the
Fourier transform would see a jump there.

The position of a rod integrates its flow, so that its error drifts. In the transform of a ramp each
coefficient falls with 1 / k^2 only, and a drift would hide the faster errors. Of a position the
differences of neighbouring samples are therefore transformed: a steady drift is c_0 alone.

Coefficient k belongs to the frequency k / (2 T) with T the length of the window. Coefficients of
one octave form a band: 0 | 1 | 2, 3 | 4 ... 7 | 8 ... 15 | and so on.

The likelihood is that of sensor noise plus a coloured disturbance.
The error in a window is noise of the sensor, with the power N_b in octave b, white or that of
rounding to a coarse grid, whichever is larger there, plus a stationary
disturbance, whose spectrum is constant in each octave and otherwise unknown. The variance s_b^2 of
the disturbance in band b has a prior about (tolerance^2 M_b), with M_b the power of the measured
signal in the band: no simulator is exact to less than this share of the motion. A small share L of
all motion is tolerated in each band as well. With P_b the mean square of the n_b independent
coefficients of the band, the variance of each candidate's own errors follows from the maximum of
the likelihood, and

    J = sum_b (n_b / 2) ln(P_b + N_b + tolerance^2 M_b + L)

is its negative logarithm, up to a constant. An error in one octave, such as a slow drift, therefore
hides nothing in the others, and no output or band needs a weight by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import numpy.typing as npt
from scipy.fft import dct, idct, next_fast_len

from ...base.numbers import FloatArray
from .comparison import Compared


@dataclass(frozen=True, eq=False)
class OutputLikelihood:
    """Likelihood of the coefficients of the errors of an output."""

    spectrum: Spectrum
    """Bands of the coefficients."""
    counts: FloatArray
    """Number n_b of independent coefficients in each band, shape (BANDS,)."""
    tolerated: FloatArray
    """Power floor^2 + tolerance^2 M_b of errors that are no gap, shape (BANDS,), > 0."""
    white: bool = False
    """True if the disturbance has the same variance in all bands. The largest errors then decide,
    which leads a fit from far away to the neighbourhood of its minimum."""
    of_motion: FloatArray | None = None
    """The part of what is tolerated that may be too much, shape (BANDS,): tolerance^2 M_b, or that
    of commands that nobody logged."""

    def narrowed(self, share: float) -> OutputLikelihood:
        """The likelihood with a tolerance of this share, 0 to 1, of what it is."""
        if self.of_motion is None or share == 1.0:
            return self
        less = (1.0 - share**2) * self.of_motion
        return replace(self, tolerated=self.tolerated - less, of_motion=share**2 * self.of_motion)

    def cost(self, coefficients: FloatArray) -> float:
        """Negative log-likelihood of coefficients (R,), nats; infinite if they are not finite."""
        powers = self.spectrum.powers(coefficients)
        if not np.isfinite(powers).all():
            return np.inf
        return self.cost_of(powers)

    def cost_of(self, powers: FloatArray) -> float:
        """Negative log-likelihood, nats, from the power in each band, shape (BANDS,)."""
        if self.white:
            return float(0.5 * self.counts.sum() * np.log(self._mean(powers + self.tolerated)))
        return float(0.5 * np.sum(self.counts * np.log(powers + self.tolerated)))

    def weights(self, coefficients: FloatArray) -> FloatArray:
        """Weight of the squares in each band, shape (BANDS,): dJ/dc = weight c."""
        errors = self.spectrum.powers(coefficients) + self.tolerated
        if self.white:
            scale = self.counts.sum() / self.spectrum.sizes.sum()
            return np.full(errors.size, scale / self._mean(errors))
        # d/dc (n / 2) ln(P + t) = n / (R_b (P + t)) c, with R_b coefficients in the band
        scale = self.counts / np.maximum(self.spectrum.sizes, 1.0)
        return np.asarray(scale / errors, dtype=np.float64)

    def _mean(self, by_band: FloatArray) -> float:
        """Mean over all coefficients of a number of each band, shape (BANDS,)."""
        return float(by_band @ self.spectrum.sizes / self.spectrum.sizes.sum())


# Number of bands. In windows of half a second the highest one ends at 256 Hz: above it, the servos
# that this is for show the noise of their sensors only.
BANDS = 9


@dataclass(frozen=True)
class _Part:
    """Coefficients of one record: W windows of N samples, of which K coefficients are kept."""

    windows: int
    length: int
    kept: int
    first: int

    @property
    def rows(self) -> int:
        return self.windows * self.kept

    def band_ends(self, number: int) -> tuple[int, int]:
        """First coefficient of a band, and the one after its last."""
        begin, end = (min(k, self.kept) for k in ((1 << number) >> 1, 1 << number))
        return begin, end

    def band(self, number: int) -> slice:
        """Rows of a band; the first rows hold coefficient 0 of each window, the next ones 1."""
        begin, end = self.band_ends(number)
        return slice(self.first + self.windows * begin, self.first + self.windows * end)


class Spectrum:
    """Transform of the errors inside the windows of records, and the bands of its coefficients.

    Windows that are shorter than the others of their record, at its end, are left out.

    Parameters
    ----------
    records
        records with windows; the same length of window in all of them, in s.
    """

    def __init__(self, records: Sequence[Compared]) -> None:
        parts, first = [], 0
        for record in records:
            windows, length = record.full_windows
            # There is one difference less than samples.
            parts.append(_Part(windows, length, min(length - 1, 1 << (BANDS - 1)), first))
            first += parts[-1].rows
        self._parts = tuple(parts)

    @cached_property
    def bands(self) -> tuple[tuple[slice, ...], ...]:
        """Rows of the coefficients of each band, record by record; BANDS tuples."""
        return tuple(tuple(part.band(number) for part in self._parts) for number in range(BANDS))

    @cached_property
    def sizes(self) -> FloatArray:
        """Number of coefficients in each band, shape (BANDS,)."""
        return np.array([sum(s.stop - s.start for s in rows) for rows in self.bands], dtype=float)

    def noise_gain(self, *, differences: bool) -> FloatArray:
        """Variance of the coefficients of each band for white noise of variance 1, (BANDS,).

        It is 1 in an empty band.
        """
        if not differences:
            return np.ones(BANDS)
        sums = np.zeros(BANDS)
        for part in self._parts:
            by_coefficient = _noise_of_differences(part.length, part.kept)
            for number in range(BANDS):
                begin, end = part.band_ends(number)
                sums[number] += part.windows * float(by_coefficient[begin:end].sum())
        return np.where(self.sizes > 0.0, sums / np.maximum(self.sizes, 1.0), 1.0)

    @property
    def windows(self) -> int:
        """Number of windows of all records together."""
        return sum(part.windows for part in self._parts)

    def transform(self, errors: Sequence[FloatArray], *, differences: bool) -> FloatArray:
        """Returns the coefficients of errors, shape (R,) or (R, n).

        errors: for each record the rows inside its windows, as `Compared.inside` gives them, shape
        (any, ) or (any, n). differences: those of neighbouring samples are transformed, so that the
        mean of a window does not count.
        """
        shape = errors[0].shape[1:]
        result = np.empty((sum(part.rows for part in self._parts), *shape))
        for part, rows in zip(self._parts, errors, strict=True):
            block = rows[: part.windows * part.length].reshape(part.windows, part.length, *shape)
            if differences:
                block = np.diff(block, axis=1)
            target = result[part.first : part.first + part.rows].reshape(
                part.kept, part.windows, *shape
            )
            if next_fast_len(block.shape[1]) > block.shape[1]:
                _transform_slow_length(np.moveaxis(block, 1, 0), target)
                continue
            kept = dct(block, type=2, norm="ortho", axis=1)[:, : part.kept]
            target[...] = np.swapaxes(kept, 0, 1)
        return result

    def powers(self, coefficients: FloatArray) -> FloatArray:
        """Mean square of the coefficients (R,) of each band, shape (BANDS,); 0 in an empty band."""
        sums = [sum(float(coefficients[s] @ coefficients[s]) for s in rows) for rows in self.bands]
        return np.array(sums) / np.maximum(self.sizes, 1.0)

    def by_window(self, rows: FloatArray) -> FloatArray:
        """Sums of rows (R,) by window and band, shape (W, BANDS)."""
        sums = np.zeros((self.windows, BANDS))
        first = 0
        for index, part in enumerate(self._parts):
            for number in range(BANDS):
                block = rows[self.bands[number][index]].reshape(-1, part.windows)
                sums[first : first + part.windows, number] = block.sum(axis=0)
            first += part.windows
        return sums

    def in_windows(self, rows: FloatArray) -> list[FloatArray]:
        """Divides rows (R, ...) by record and window: (windows, coefficients, ...) of each."""
        return [
            np.swapaxes(
                rows[part.first : part.first + part.rows].reshape(
                    part.kept, part.windows, *rows.shape[1:]
                ),
                0,
                1,
            )
            for part in self._parts
        ]

    def window_of_rows(self) -> npt.NDArray[np.int64]:
        """Number of the window of each row, counted through all records, shape (R,)."""
        numbers, first = [], 0
        for part in self._parts:
            numbers.append(np.tile(np.arange(first, first + part.windows), part.kept))
            first += part.windows
        return np.concatenate(numbers)

    def spread(self, by_band: FloatArray) -> FloatArray:
        """Repeats a number of each band, shape (BANDS,), for each of its rows, shape (R,)."""
        rows = np.empty(sum(part.rows for part in self._parts))
        for number, slices in enumerate(self.bands):
            for s in slices:
                rows[s] = by_band[number]
        return rows


def _transform_slow_length(block: FloatArray, target: FloatArray) -> None:
    """Writes the first K coefficients of a block (N, ...) to a target (K, ...).

    For lengths with a large prime factor, such as 499: the fast transform takes six times as long
    as that of 500, and products with the rows of the matrix take half of that. Rows of even number
    are symmetric and those of odd number antisymmetric, so that half of each row is enough.
    """
    even, odd = _half_rows(block.shape[0], target.shape[0])
    columns = block.reshape(block.shape[0], -1)
    first, last = columns[: even.shape[1]], columns[::-1][: even.shape[1]]
    rows = target.reshape(target.shape[0], -1)
    rows[0::2] = even @ (first + last)
    rows[1::2] = odd @ (first - last)


@cache
def _half_rows(length: int, kept: int) -> tuple[FloatArray, FloatArray]:
    """First halves of the transform's rows of even and of odd number, (K / 2, (length + 1) / 2)."""
    half = (length + 1) // 2
    rows = idct(np.eye(length)[:kept], type=2, norm="ortho", axis=1)[:, :half]
    if length % 2:
        rows[:, -1] *= 0.5  # the middle is its own counterpart
    return np.ascontiguousarray(rows[0::2]), np.ascontiguousarray(rows[1::2])


@cache
def _noise_of_differences(length: int, kept: int) -> FloatArray:
    """Variance of each coefficient of the differences of white noise of variance 1, (kept,)."""
    # c = B D e, var c_k = |D' b_k|^2, with D the differences and b_k the rows of the transform B
    basis = idct(np.eye(length - 1)[:kept], type=2, norm="ortho", axis=1)
    return np.asarray(np.sum(np.diff(basis, prepend=0.0, append=0.0) ** 2, axis=1))
