# SPDX-License-Identifier: MIT
"""A case with what is true, what was said, and what is to be thought of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.reading import Answer, Said
from ehsid.harness.validation.scoring.right import Judgement, left_out
from ehsid.harness.validation.scoring.transfer import Transfer

# Of the gap of the calibrated rig over its floor: below the first nothing can be demanded.
GAP_SIZES = (3.0, 10.0)
GAP_NAMES = ("below 3 x floor", "3 to 10 x floor", "above 10 x floor", "gap not known")


@dataclass(frozen=True)
class Scored:
    """A finished case; transfer is None where no third record was kept or nothing was compared."""

    name: str
    answer: Answer
    said: Said
    judged: Judgement
    transfer: Transfer | None = None

    @property
    def gap_size(self) -> str:
        """One of `GAP_NAMES`."""
        if self.said.gap is None:
            return GAP_NAMES[-1]
        return GAP_NAMES[sum(self.said.gap >= size for size in GAP_SIZES)]

    @property
    def demanded(self) -> bool:
        """The gap is large enough to ask for a name; so is one that the diagnosis did not tell."""
        return self.said.gap is None or self.said.gap >= GAP_SIZES[0]

    @property
    def left_out(self) -> bool:
        """The diagnosis had to do without a true effect."""
        return left_out(self.answer, self.said)

    @property
    def friction(self) -> bool:
        """One of its effects is friction."""
        return any(one.endswith("_friction") for one in self.answer.effects)


def by(cases: Sequence[Scored], key: Callable[[Scored], str]) -> dict[str, list[Scored]]:
    """Cases in groups, in alphabetic order."""
    return {
        group: [case for case in cases if key(case) == group]
        for group in sorted({key(case) for case in cases})
    }
