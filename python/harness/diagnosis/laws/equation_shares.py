# SPDX-License-Identifier: MIT
"""Shares of the equations in the gap, and what those with a large share lack over the time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from msgspec.structs import replace

from ...base.parallel import Progress, part_of
from ..model.case import Case
from ..result import UnknownInput
from ..schema import SUBSYSTEM_TAKES_PART, Equation
from ..search.candidates import FittedCandidate
from .equation_terms import SUBSYSTEM, equation_terms
from .unknown_inputs import unknown_input

# Gain, nats, below which no equation lacks anything that the records show.
LEAST_GAIN = 3.0
# Gains that differ by this are in the proportion e. The errors of a model repeat, so that a nat of
# evidence is worth less than one: on 87 machines of development the shares with 25 gave the true
# part the highest mean logarithm.
NATS = 25.0
# Share of the time that the fits of the terms take; the unknown inputs take the rest.
TERMS = 0.9


def equation_shares(
    case: Case, calibrated: FittedCandidate, progress: Progress | None = None
) -> tuple[tuple[Equation, ...], tuple[UnknownInput, ...]]:
    """Returns the equations and what those with a large share lack over the time.

    The largest share is first; there are none where no term explains anything.

    A part of the machine counts by the largest gain of its equations, so that one with two
    equations is not preferred.
    """
    terms = equation_terms(case, calibrated, part_of(progress, 0.0, TERMS))
    shares = shares_of({each.equation: each.gain for each in terms})
    rows, lacking = [], []
    for each in sorted(terms, key=lambda each: -shares.get(each.equation, 0.0)):
        if each.equation not in shares:
            continue
        row = Equation(each.equation, SUBSYSTEM[each.equation], shares[each.equation], each.gain)
        if row.share >= SUBSYSTEM_TAKES_PART:
            lacks = unknown_input(each)
            lacking.append(lacks)
            row = replace(row, of=lacks.of, explained=lacks.explained)
        rows.append(row)
    return tuple(rows), tuple(lacking)


def shares_of(gains: Mapping[str, float]) -> dict[str, float]:
    """Shares by equation, sum 1, from the gains in nats; empty where none is large enough."""
    largest = max(gains.values(), default=0.0)
    if not largest >= LEAST_GAIN:
        return {}
    weights = {name: math.exp((gain - largest) / NATS) for name, gain in gains.items()}
    subsystems: dict[str, list[float]] = {}
    for name, weight in weights.items():
        subsystems.setdefault(SUBSYSTEM[name], []).append(weight)
    total = sum(max(each) for each in subsystems.values())
    return {
        name: weight / total * _of_one(subsystems[SUBSYSTEM[name]])
        for name, weight in weights.items()
    }


def _of_one(weights: Sequence[float]) -> float:
    """Factor for which the weights add up to the largest of them."""
    return max(weights) / sum(weights)
