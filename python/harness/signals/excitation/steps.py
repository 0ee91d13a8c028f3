# SPDX-License-Identifier: MIT
"""Random steps: random levels, each held for a random time."""

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
    """Returns random levels from -amplitude to amplitude, each held for a random time, shape (n,).

    Parameters
    ----------
    n
        number of samples, at least 1.
    amplitude
        largest level in the unit of the command, finite, >= 0.
    hold
        smallest and largest number of samples for which a level is held, 1 <= fewest <= most. The
        end of the signal may cut the last level.
    rng
        generator that draws levels and times.
    levels
        number of evenly spaced levels, >= 2; the next level then always differs. By default, any
        level of the interval is possible.
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
        # A cyclic move by 1 to levels - 1 places never returns to the same level.
        places = rng.integers(1, levels, size=lengths.size)
        places[0] = rng.integers(0, levels)
        values = np.linspace(-amplitude, amplitude, levels)[np.cumsum(places) % levels]
    return np.repeat(values, lengths)[:n]
