# SPDX-License-Identifier: MIT
"""Selects fewer samples for a plot, without loss of any peak."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

NONE: npt.NDArray[np.int64] = np.zeros(0, dtype=np.int64)


def kept_samples(
    signals: Sequence[npt.NDArray[np.float64]],
    most: int,
    always: npt.NDArray[np.int64] = NONE,
) -> npt.NDArray[np.int64]:
    """Returns indices of the samples to draw: the extremes of each signal in equal stretches.

    Parameters
    ----------
    signals
        signals of one length N over the same time; NaN is ignored if a stretch has other values.
    most
        approximate number of samples to keep; if N is not larger, all samples are kept.
    always
        indices of further samples to keep.

    Returns
    -------
    Increasing indices, with those of the first and the last sample.
    """
    size = signals[0].size
    if size <= most:
        return np.arange(size)
    stretch = -(-size // max(1, most // (2 * len(signals))))
    stretches = -(-size // stretch)
    begins = stretch * np.arange(stretches)
    places = [np.array([0, size - 1]), always]
    for signal in signals:
        for sign in (1.0, -1.0):
            padded = np.full(stretches * stretch, np.inf)
            padded[:size] = np.where(np.isnan(signal), np.inf, sign * signal)
            places.append(begins + np.argmin(padded.reshape(stretches, stretch), axis=1))
    kept = np.unique(np.concatenate(places))
    return np.asarray(kept[kept < size], dtype=np.int64)
