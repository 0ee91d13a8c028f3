# SPDX-License-Identifier: MIT
"""Commands that nobody logged, as unknown inputs: errors that they can cause count for little.

A command between samples k and k + 1 that differs from the mean course by about s_k, see
`between_samples`, changes the coefficients of the errors in its window and in the next one. In a
window, with these changes J and with what is tolerated without such commands, V,

    e ~ N(0, V + J diag(s^2) J')

The errors of all outputs are therefore replaced by

    V^(1/2) (I + Z Z')^(-1/2) V^(-1/2) e,   Z = V^(-1/2) J diag(s) = U diag(q) W'
            (I + Z Z')^(-1/2) = I + U diag((1 + q^2)^(-1/2) - 1) U'

which have the variance V again (generalised least squares: A. C. Aitken, Proc. R. Soc. Edinburgh
55, 1936; unknown inputs as a part of the noise: S. Gillijns, B. De Moor, Automatica 43(1), 2007).
An error that such commands cannot cause stays as it is: one pressure against the other, or any
error where the command rests. The determinant of the variance is the same for all candidates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...base.parallel import run_threads
from .comparison import Compared
from .spectrum import Spectrum

# The move of the command between samples; it has none where one more command is sent there.
BETWEEN = "nuisance.between_samples"
# Most samples of a window: the runs of the simulator and the directions grow with them.
LONGEST = 128
# Commands that together have less than this share of the power of all are left out.
NEEDLESS = 0.01
# Directions that the whitening changes by less than a twentieth are left as they are.
LEAST_SINGULAR = 0.33


@dataclass(frozen=True, eq=False)
class Whitening:
    """The whitening of the errors in the W windows of one record."""

    between: FloatArray
    """Mean course of the command in the middle between each sample and the next one, V, (N,)."""
    numbers: npt.NDArray[np.int64]
    """Numbers of the windows, rising, shape (W,)."""
    directions: FloatArray
    """U, shape (W, R, n), for the R coefficients of all outputs."""
    less: FloatArray
    """(1 + q^2)^(-1/2) - 1, shape (W, n); 0 where a window has fewer directions."""
    scales: Mapping[str, FloatArray]
    """V^(1/2) by output, shape (K,) for the K coefficients of a window."""
    moves: bool = True
    """Whether the command moves between the samples; else `between` is as logged, and n is 0."""

    @property
    def widening(self) -> tuple[float, int]:
        """1/2 ln det(I + Z Z') of all windows, and the number of their coefficients.

        It is what the whitening takes from the negative log-likelihood, nats.
        """
        windows, rows, _ = self.directions.shape
        return -float(np.log1p(self.less).sum()), windows * rows

    def of(self, record: Compared) -> Whitening:
        """The whitening of the windows that a record has, which may be some of these."""
        windows, _ = record.full_windows
        places = np.searchsorted(self.numbers, np.unique(record.window[record.used])[:windows])
        return Whitening(
            self.between,
            self.numbers[places],
            self.directions[places],
            self.less[places],
            self.scales,
            self.moves,
        )

    def applied(self, blocks: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Returns the whitened coefficients by output; both have the shape (W, K, ...)."""
        scales = {name: scale[:, np.newaxis] for name, scale in self.scales.items()}
        errors = np.concatenate(
            [
                blocks[name].reshape(*blocks[name].shape[:2], -1) / scale
                for name, scale in scales.items()
            ],
            axis=1,
        )
        along = np.swapaxes(self.directions, 1, 2) @ errors
        errors += self.directions @ (self.less[:, :, np.newaxis] * along)
        ends = np.cumsum([scale.size for scale in scales.values()])[:-1]
        return {
            name: (part * scale).reshape(blocks[name].shape)
            for (name, scale), part in zip(
                scales.items(), np.split(errors, ends, axis=1), strict=True
            )
        }


def whitened(
    spectrum: Spectrum, whitenings: Sequence[Whitening], coefficients: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Returns whitened coefficients by output, shape (R, ...) as the given ones."""
    blocks = {name: spectrum.in_windows(rows) for name, rows in coefficients.items()}
    by_record = [
        whitening.applied({name: of_records[i] for name, of_records in blocks.items()})
        for i, whitening in enumerate(whitenings)
    ]
    return {
        name: np.concatenate(
            [
                np.swapaxes(block, 0, 1).reshape(block.shape[0] * block.shape[1], *rows.shape[1:])
                for block in (each[name] for each in by_record)
            ]
        )
        for name, rows in coefficients.items()
    }


def sent_twice(
    command: FloatArray, between: FloatArray, aligned: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns a command with one more between each sample and the next, shape (2 N,).

    And the states that replace those of the simulator, shape (2 N, 4), from those at the samples.
    """
    finer = np.full((2 * aligned.shape[0], aligned.shape[1]), np.nan)
    finer[::2] = aligned
    return np.stack([command, between], axis=1).ravel(), finer


def whitening_of(
    record: Compared,
    between: FloatArray,
    deviation: FloatArray,
    changed: Callable[[FloatArray], Mapping[str, FloatArray]],
    tolerated: Mapping[str, FloatArray],
) -> Whitening:
    """Returns the whitening of all windows of a record.

    Parameters
    ----------
    record
        the whole record.
    between
        see `Whitening`.
    deviation
        s_k of the command between each sample and the next one, V, shape (N,); 0 everywhere where
        the command is held.
    changed
        half the difference of the coefficients (R,) by output, for commands that differ from the
        mean course by a signal of shape (N,), and by its opposite.
    tolerated
        power by output and octave that is tolerated without such commands, shape (BANDS,).
    """
    spectrum = Spectrum([record])
    windows, _ = record.full_windows
    numbers = np.unique(record.window[record.used])[:windows]
    scales = {
        name: np.sqrt(spectrum.in_windows(spectrum.spread(by_band))[0][0])
        for name, by_band in tolerated.items()
    }
    if not deviation.any():
        rows = sum(scale.size for scale in scales.values())
        return Whitening(
            between, numbers, np.zeros((windows, rows, 0)), np.zeros((windows, 0)), scales, False
        )
    groups = _groups(record, deviation)
    responses = run_threads(
        [
            partial(changed, np.where(groups == group, deviation, 0.0))
            for group in range(int(groups.max()) + 1)
        ]
    )
    whole = np.concatenate(
        [
            spectrum.in_windows(np.stack([each[name] for each in responses], axis=1))[0]
            / scale[:, np.newaxis]
            for name, scale in scales.items()
        ],
        axis=1,
    )
    directions, singular, _ = np.linalg.svd(whole, full_matrices=False)
    counts = singular > LEAST_SINGULAR
    most = int(np.count_nonzero(counts, axis=1).max())
    less = np.where(counts, 1.0 / np.sqrt(1.0 + singular**2) - 1.0, 0.0)
    return Whitening(
        between, numbers, np.ascontiguousarray(directions[:, :, :most]), less[:, :most], scales
    )


def _groups(record: Compared, deviation: FloatArray) -> npt.NDArray[np.int64]:
    """Commands of one number are two windows apart, so that one run tells them all, shape (N,).

    -1 where a command is left out.
    """
    _, length = record.full_windows
    first = int(np.flatnonzero(record.used)[0])
    window = (np.arange(deviation.size) - first) // length
    order = np.argsort(deviation)
    power = np.cumsum(deviation[order] ** 2)
    counts = np.ones(deviation.size, dtype=bool)
    counts[order[power < NEEDLESS * power[-1]]] = False
    # The number of each command among those of its window that count
    before = np.cumsum(counts) - counts
    begins = np.flatnonzero(np.diff(window, prepend=window[0] - 1))
    number = before - before[begins][window - window[0]]
    of_even = int(number[counts & (window % 2 == 0)].max(initial=-1)) + 1
    return np.where(counts, number + of_even * (window % 2), -1)
