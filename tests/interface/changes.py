# SPDX-License-Identifier: MIT
"""A change of the interface, and the comparison of two tables of symbols."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Change:
    """One symbol that is not as it was.

    Parameters
    ----------
    interface
        "C++", "C", "Python", "command line" or "files".
    what
        additions do not break the code of a user, removals and changes do.
    symbol
        the name as a user writes it.
    was, now
        its signature, type or value before and after.
    detail
        what about the symbol has changed, where `was` and `now` do not say it.
    """

    interface: str
    what: Literal["added", "removed", "changed"]
    symbol: str
    was: str
    now: str
    detail: str = ""

    @property
    def breaks(self) -> bool:
        """Can it break what a user has?"""
        return self.what != "added"

    def __str__(self) -> str:
        head = f"{self.interface}: {self.symbol}"
        if self.what != "changed":
            return f"{head}: {self.what}"
        detail = f" ({self.detail})" if self.detail else ""
        return f"{head}: changed{detail}: it was `{self.was}` and is now `{self.now}`"


def table_changes(
    interface: str, before: Mapping[str, str], now: Mapping[str, str]
) -> list[Change]:
    """Compares two tables from symbols to their signatures."""
    found = []
    for symbol in sorted(before.keys() | now.keys()):
        old, new = before.get(symbol), now.get(symbol)
        if old is None:
            found.append(Change(interface, "added", symbol, "", new or ""))
        elif new is None:
            found.append(Change(interface, "removed", symbol, old, ""))
        elif old != new:
            found.append(Change(interface, "changed", symbol, old, new))
    return found
