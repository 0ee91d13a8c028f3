# SPDX-License-Identifier: MIT
"""Faults by chance on the line between host and target; see `ehsid.hil.faults`."""

import random
from collections.abc import Sequence
from dataclasses import dataclass, field

from ehsid.hil.faults import FAULTS, Passing, fault, undisturbed


@dataclass
class Seeded:
    """Each frame has one of these faults with this probability; the same for the same seed."""

    seed: int
    kinds: Sequence[str] = FAULTS
    probability: float = 0.2
    hold_s: float = 0.06
    made: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rng = random.Random(self.seed)

    def __call__(self, direction: str, number: int, frame: bytes) -> Passing:
        if self._rng.random() >= self.probability:
            return undisturbed(direction, number, frame)
        kind = self._rng.choice(list(self.kinds))
        self.made.append(f"{kind} {direction}")
        return fault(kind, frame, self._rng, self.hold_s)
