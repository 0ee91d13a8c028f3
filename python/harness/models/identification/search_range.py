# SPDX-License-Identifier: MIT
"""The orders and delays that a search tries, as users write them."""

from __future__ import annotations

import re

# Beyond these a search over orders and delays takes hours, and its models have no meaning.
MOST_ORDER, MOST_DELAY = 50, 1000


def parse_range(text: str, option: str, most: int) -> range:
    """Returns the range that a text such as "2-5" or "3" names, upper end included.

    Raises
    ------
    ValueError
        the text is no range of whole numbers from 0 to `most`.
    """
    match = re.fullmatch(r"([0-9]{1,9})(?:-([0-9]{1,9}))?", text.strip())
    low, high = (int(match[1]), int(match[2] or match[1])) if match else (0, -1)
    if not low <= high <= most:
        raise ValueError(
            f"{option} {text!r}: expected a number or a range such as 2-5, at most {most}"
        )
    return range(low, high + 1)
