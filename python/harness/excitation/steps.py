# SPDX-License-Identifier: MIT
"""Random levels, each held for a random time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def random_steps(
    n: int, *, amplitude: float, hold: tuple[int, int], rng: np.random.Generator
) -> npt.NDArray[np.float64]:
    """Levels drawn evenly from -amplitude to amplitude, each held for `hold` samples.

    Parameters
    ----------
    n
        samples, at least 1.
    amplitude
        largest level, >= 0.
    hold
        fewest and most samples a level is held, 1 <= fewest <= most.
    rng
        draws levels and times.
    """
    fewest, most = hold
    if not (n >= 1 and amplitude >= 0.0 and 1 <= fewest <= most):
        raise ValueError(
            f"random_steps: n = {n}, amplitude = {amplitude:g}, hold = {hold}: expected n >= 1, "
            "amplitude >= 0, 1 <= fewest <= most"
        )
    lengths = rng.integers(fewest, most, size=-(-n // fewest), endpoint=True)
    levels = rng.uniform(-amplitude, amplitude, size=lengths.size)
    return np.repeat(levels, lengths)[:n]
