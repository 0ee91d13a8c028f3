# SPDX-License-Identifier: MIT
"""What differs between two rigs: values that moved, and values that were added or left out."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .rig import Rig


@dataclass(frozen=True)
class Change:
    """A value that differs, by its full name, in SI; None where a rig does not have it."""

    key: str
    before: float | None
    after: float | None

    @property
    def share(self) -> float | None:
        """Change as a share of the value before; None where there is no such share."""
        if self.before is None or self.after is None or self.before == 0.0:
            return None
        return (self.after - self.before) / abs(self.before)


def changes(before: Rig, after: Rig, *, least: float = 0.0) -> list[Change]:
    """Returns what differs: first the values of `before` in their order, then those added.

    Parameters
    ----------
    before, after
        the two rigs.
    least
        share of a value below which its change is left out.
    """
    found = [
        Change(key, before.values.get(key), after.values.get(key))
        for key in {**before.values, **after.values}
    ]
    return [one for one in found if not _same(one, least)]


def _same(change: Change, least: float) -> bool:
    if change.before is None or change.after is None:
        return False
    return math.isclose(change.before, change.after, rel_tol=least)
