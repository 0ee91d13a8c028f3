# SPDX-License-Identifier: MIT
"""The possible answers for a machine, most probable first, and which of them is true.

An answer is a set of effects with all laws of friction as one, nothing missing, or "outside".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.diagnosis.search.families import effect_families

from ..scoring.judging import KNOWN, is_true
from .choices import BoolArray
from .machines import Machine


@dataclass(frozen=True, eq=False)
class Ranked:
    """K answers for a machine, by falling probability.

    Attributes
    ----------
    machine
        the machine.
    effects
        effects of each answer; None for "outside of the catalogue".
    chances
        (K,): probabilities; their sum is 1.
    true
        (K,): whether the answer is the truth; at least one is.
    """

    machine: Machine
    effects: tuple[tuple[str, ...] | None, ...]
    chances: FloatArray
    true: BoolArray

    @property
    def before(self) -> FloatArray:
        """Probability of all answers that are more probable than each answer, (K,)."""
        return np.concatenate([[0.0], np.cumsum(self.chances[:-1])])

    @property
    def above_truth(self) -> float:
        """Probability of all answers that are more probable than the truth, 0 to 1."""
        return float(self.before[np.argmax(self.true)])

    def count_up_to(self, threshold: float) -> int:
        """Number of answers before which all together have at most this probability."""
        return int(np.sum(self.before <= threshold))

    def effect_chances(self) -> list[tuple[float, bool]]:
        """Probability of each effect of the first answer, and whether the machine has it."""
        truth = self.machine.truth if self.machine.kind in KNOWN else ()
        return [(self._chance(effect), is_true(effect, truth)) for effect in self.effects[0] or ()]

    def _chance(self, effect: str) -> float:
        family = effect_families((effect,))
        having = [family <= effect_families(effects or ()) for effects in self.effects]
        return float(self.chances[having].sum())


def ranked(machines: Sequence[Machine], chances: FloatArray) -> list[Ranked]:
    """Returns the ranked answers; `chances` has the shape and order of `choices.probabilities`."""
    return [_ranked(machine, row) for machine, row in zip(machines, chances, strict=True)]


def _ranked(machine: Machine, row: FloatArray) -> Ranked:
    # By family of answers: the first effects that stand for it, probability, and truth.
    answers: dict[frozenset[str] | None, tuple[tuple[str, ...] | None, float, bool]] = {
        None: (None, float(row[-1]), machine.outside)
    }
    for each, chance, true in zip(machine.sets, row[:-1], machine.true_sets, strict=False):
        family = effect_families(each.effects)
        effects, before, was_true = answers.get(family, (each.effects, 0.0, False))
        answers[family] = (effects, before + float(chance), was_true or true)
    order = sorted(answers.values(), key=lambda answer: -answer[1])
    return Ranked(
        machine,
        tuple(effects for effects, _, _ in order),
        np.array([chance for _, chance, _ in order]),
        np.array([true for _, _, true in order]),
    )
