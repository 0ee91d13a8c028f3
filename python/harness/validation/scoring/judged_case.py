# SPDX-License-Identifier: MIT
"""A finished case: its truth, its diagnosis, and the judgement of the diagnosis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.reading import Answer, Said
from ehsid.harness.validation.scoring.right import Judgement, left_out
from ehsid.harness.validation.scoring.transfer import Transfer

# Limits of the calibrated rig's gap over its noise floor; below the first, no name is demanded.
GAP_SIZES = (3.0, 10.0)
GAP_NAMES = ("below 3 x floor", "3 to 10 x floor", "above 10 x floor", "gap not known")


@dataclass(frozen=True)
class Scored:
    """A finished case; `transfer` is None without a third record or without compared outputs."""

    name: str
    answer: Answer
    said: Said
    judged: Judgement
    transfer: Transfer | None = None

    @property
    def gap_size(self) -> str:
        """Size of the gap over its noise floor in words, one of `GAP_NAMES`."""
        if self.said.gap is None:
            return GAP_NAMES[-1]
        return GAP_NAMES[sum(self.said.gap >= size for size in GAP_SIZES)]

    @property
    def demanded(self) -> bool:
        """Whether the gap is large enough to demand a name; True where the gap is not known."""
        return self.said.gap is None or self.said.gap >= GAP_SIZES[0]

    @property
    def left_out(self) -> bool:
        """Whether the diagnosis had to leave out a true effect."""
        return left_out(self.answer, self.said)

    @property
    def friction(self) -> bool:
        """Whether one of the true effects is friction."""
        return any(one.endswith("_friction") for one in self.answer.effects)


def by(cases: Sequence[Scored], key: Callable[[Scored], str]) -> dict[str, list[Scored]]:
    """Groups the cases by the key; the groups are in alphabetic order."""
    return {
        group: [case for case in cases if key(case) == group]
        for group in sorted({key(case) for case in cases})
    }
