# SPDX-License-Identifier: MIT
"""Types of the arrays that go between modules, and what all of them check.

Shapes stand in the docstrings of functions.

Numbers for people: no exponent where none is needed.
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


# From this size on a number has an exponent.
EXPONENT_FROM = 1e7


def plain_number(value: float, digits: int) -> str:
    """Returns a number with so many significant digits, such as 1650 where `g` makes 1.65e+03.

    Only numbers below 1e-4 and from 1e7 on have an exponent.
    """
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) < EXPONENT_FROM else text
