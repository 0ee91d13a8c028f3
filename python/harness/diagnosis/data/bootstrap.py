# SPDX-License-Identifier: MIT
"""Bootstrap over whole windows (H. R. Künsch, Ann. Statist. 17(3), 1989).

Errors within a window are correlated, those of different windows hardly: windows are drawn with
replacement, each with all its samples.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray

# Confidence intervals of the shrinkage. The contract fixes their level; the number of bootstrap
# draws gives the ends a second digit.
SHRINKAGE_LEVEL = 0.9
BOOTSTRAP_DRAWS = 500
BOOTSTRAP_SEED = 20261121


def drawn_windows(windows: int, seed: int = BOOTSTRAP_SEED) -> npt.NDArray[np.int64]:
    """Returns the numbers of the windows in each draw, shape (BOOTSTRAP_DRAWS, windows)."""
    return np.random.default_rng(seed).integers(windows, size=(BOOTSTRAP_DRAWS, windows))


def interval(draws: FloatArray) -> tuple[float, float]:
    """Returns the interval of level SHRINKAGE_LEVEL of the values of all draws; NaN is left out."""
    tail = 0.5 * (1.0 - SHRINKAGE_LEVEL)
    low, high = np.nanquantile(draws, [tail, 1.0 - tail])
    return float(low), float(high)
