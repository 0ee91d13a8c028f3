# SPDX-License-Identifier: MIT
"""Text of others, such as names of rigs and records, as it may be shown."""

from __future__ import annotations

import unicodedata


def printable(text: str) -> str:
    r"""Returns the text with control characters written out, such as \x1b.

    These are also the characters that change the direction of writing, with which a name can look
    like another one. Line ends and spaces of all kinds stay.
    """

    def harmless(c: str) -> bool:
        return c.isprintable() or c == "\n" or unicodedata.category(c) == "Zs"

    return "".join(c if harmless(c) else repr(c)[1:-1] for c in text)
