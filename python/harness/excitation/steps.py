# SPDX-License-Identifier: MIT
"""Random levels, each held for a random time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def random_steps(
    n: int,
    *,
    amplitude: float,
    hold: tuple[int, int],
    rng: np.random.Generator,
    levels: int | None = None,
) -> npt.NDArray[np.float64]:
    """Levels drawn from -amplitude to amplitude, each held for `hold` samples.

    Parameters
    ----------
    n
        samples, at least 1.
    amplitude
        largest level, finite, >= 0.
    hold
        fewest and most samples a level is held, 1 <= fewest <= most; the end may cut the last.
    rng
        draws levels and times.
    levels
        number of levels, evenly spaced, >= 2, each followed by another one; by default any level
        of the interval.
    """
    fewest, most = hold
    if not (n >= 1 and 0.0 <= amplitude < np.inf and 1 <= fewest <= most):
        raise ValueError(
            f"random_steps: n = {n}, amplitude = {amplitude:g}, hold = {hold}: expected n >= 1, "
            "finite amplitude >= 0, 1 <= fewest <= most"
        )
    if levels is not None and levels < 2:
        raise ValueError(f"random_steps: levels = {levels}: expected levels >= 2")
    lengths = rng.integers(fewest, most, size=-(-n // fewest), endpoint=True)
    if levels is None:
        values = rng.uniform(-amplitude, amplitude, size=lengths.size)
    else:
        # Going on by 1 to levels - 1 places, round and round, never stays.
        places = rng.integers(1, levels, size=lengths.size)
        places[0] = rng.integers(0, levels)
        values = np.linspace(-amplitude, amplitude, levels)[np.cumsum(places) % levels]
    return np.repeat(values, lengths)[:n]
