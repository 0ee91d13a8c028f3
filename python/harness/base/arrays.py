# SPDX-License-Identifier: MIT
"""Types of the arrays that go between modules, and what all of them check.

Shapes stand in the docstrings of functions.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
"""Of doubles."""


def masked_count(values: npt.ArrayLike) -> int:
    """Returns how many values of a masked array are masked; 0 for other arrays.

    NumPy drops the mask without a word where it makes an ordinary array, and then counts in
    what the mask had left out.
    """
    return int(np.sum(np.ma.getmaskarray(values))) if np.ma.isMaskedArray(values) else 0
