# SPDX-License-Identifier: MIT
"""Numbers for people: no exponent where none is needed."""

from __future__ import annotations

# From this size on a number has an exponent.
EXPONENT_FROM = 1e7


def plain_number(value: float, digits: int) -> str:
    """Returns a number with so many significant digits, such as 1650 where `g` makes 1.65e+03.

    Only numbers below 1e-4 and from 1e7 on have an exponent.
    """
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) < EXPONENT_FROM else text
