# SPDX-License-Identifier: MIT
"""Fewer samples for a plot, with every peak still there."""

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
    """Places of the samples to draw: lowest and highest of each signal in equal stretches.

    Parameters
    ----------
    signals
        of one length N, drawn over the same time; NaN is never lowest or highest.
    most
        about so many samples; all N where they are fewer.
    always
        places to keep besides.

    Returns
    -------
    Increasing, with the first and the last sample.
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
