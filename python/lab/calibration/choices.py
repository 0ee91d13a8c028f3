# SPDX-License-Identifier: MIT
"""Scores and probabilities of all weighed sets of many machines at once, for any constants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.families import law_count
from ehsid.harness.diagnosis.decision.hypotheses import outside_score, probabilities_of
from ehsid.harness.diagnosis.search.score import Constants, score

from .machines import Machine

BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Choices:
    """The sets of N machines as arrays; M is the largest number of sets of one machine."""

    left: FloatArray
    laws: FloatArray
    small: FloatArray
    price: FloatArray
    """(N, M): arguments of `score.score`; zero where a machine has fewer sets."""
    present: BoolArray
    """(N, M): whether the machine has this set."""
    left_by_none: FloatArray
    """(N,): errors that the calibrated rig leaves."""
    pressures: BoolArray
    """(N,): whether pressures are measured."""
    true: BoolArray
    """(N, M + 1): whether this set is the truth; the last column is "outside of the catalogue"."""

    def of(self, which: IntArray | BoolArray) -> Choices:
        """Returns the choices of some of the machines, by index or mask."""
        return Choices(
            self.left[which],
            self.laws[which],
            self.small[which],
            self.price[which],
            self.present[which],
            self.left_by_none[which],
            self.pressures[which],
            self.true[which],
        )


def choices_of(machines: Sequence[Machine]) -> Choices:
    """Returns the sets of one machine or more as arrays."""
    shape = len(machines), max(len(machine.sets) for machine in machines)
    left, laws, small, price = (np.zeros(shape) for _ in range(4))
    present = np.zeros(shape, dtype=np.bool_)
    true = np.zeros((shape[0], shape[1] + 1), dtype=np.bool_)
    for i, machine in enumerate(machines):
        count = len(machine.sets)
        left[i, :count] = [each.left for each in machine.sets]
        laws[i, :count] = [law_count(each.effects) for each in machine.sets]
        small[i, :count] = [each.small for each in machine.sets]
        price[i, :count] = [each.price for each in machine.sets]
        present[i, :count] = True
        true[i, :count] = machine.true_sets
        true[i, -1] = machine.outside
    return Choices(
        left,
        laws,
        small,
        price,
        present,
        np.array([machine.left_by_none for machine in machines]),
        np.array([machine.pressures for machine in machines]),
        true,
    )


def best_sets(choices: Choices, constants: Constants) -> IntArray:
    """Index of the set with the best score of each machine, (N,)."""
    return np.asarray(np.argmax(_of_sets(choices, constants), axis=1))


def scores(choices: Choices, constants: Constants, best: IntArray | None = None) -> FloatArray:
    """Scores u, nats, (N, M + 1); -inf where a machine has no such set. The last: outside.

    best: the sets beside which outside stands, (N,); without it, those of `best_sets`.
    """
    of_sets = _of_sets(choices, constants)
    beside = (np.argmax(of_sets, axis=1) if best is None else best)[:, np.newaxis]
    outside = outside_score(
        np.take_along_axis(of_sets, beside, axis=1)[:, 0],
        np.take_along_axis(choices.left, beside, axis=1)[:, 0],
        choices.left_by_none,
        choices.pressures,
        constants,
    )
    return np.column_stack([of_sets, outside])


def _of_sets(choices: Choices, constants: Constants) -> FloatArray:
    of_sets = score(choices.left, choices.laws, choices.small, choices.price, constants)
    return np.where(choices.present, of_sets, -np.inf)


def probabilities(
    choices: Choices, constants: Constants, best: IntArray | None = None
) -> FloatArray:
    """Probabilities (N, M + 1) of the sets and of outside; each row has the sum 1. As `scores`."""
    return probabilities_of(scores(choices, constants, best), constants)


def log_loss(chances: FloatArray, true: BoolArray) -> FloatArray:
    """Returns -ln of the probability of the truth, nats, (N,)."""
    return np.asarray(-np.log(np.where(true, chances, 0.0).sum(axis=1)))
