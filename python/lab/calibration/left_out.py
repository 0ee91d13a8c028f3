# SPDX-License-Identifier: MIT
"""Families of structure, each left out in turn: constants and thresholds come from all others.

Machines of a family that the calibration never saw are not exchangeable with those it saw, so that
nothing is promised for them; the worst family tells how much that may matter elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.base.parallel import Progress
from ehsid.harness.diagnosis.decision.constants import Constants

from ..scoring.figures import Figure, Range, mean, share
from .choices import BoolArray, Choices, probabilities
from .conformal import LEVELS, holds, size, thresholds
from .fitting import fit
from .machines import Machine
from .ranking import ranked
from .reliability import Reliability, first_answers, reliability

# Fewer machines say nothing of a coverage: the interval of 19 out of 20 is 13 % wide. As many must
# remain, or nothing can be fitted.
LEAST_MACHINES = 20


@dataclass(frozen=True)
class LeftOut:
    """A family that was left out.

    Attributes
    ----------
    trait, family
        trait and name of the family.
    promised
        share of its machines whose set should hold the truth, as far as they are like the others.
    coverage
        share of its machines whose set holds the truth.
    size
        mean number of answers in a set.
    right
        share of its machines whose first answer is the truth.
    reliability
        reliability of the first answers.
    """

    trait: str
    family: str
    promised: float
    coverage: Figure
    size: Figure
    right: Figure
    reliability: Reliability


def left_out_families(
    machines: Sequence[Machine], choices: Choices, start: Constants, progress: Progress | None
) -> tuple[LeftOut, ...]:
    """Leaves out each family that has enough machines, and returns the worst first.

    The worst is the one whose interval of the coverage ends lowest: small families scatter, and the
    lowest value alone would often be that of the smallest.

    Parameters
    ----------
    machines, choices
        all machines, and their sets as arrays.
    start
        constants from which each fit starts: those of all machines.
    progress
        called with the share of the families that is done.
    """
    families = list(_families(machines))
    found = []
    for number, (trait, family, inside) in enumerate(families, 1):
        found.append(_left_out(machines, choices, start, trait, family, inside))
        if progress is not None:
            progress(number / len(families))
    return tuple(sorted(found, key=lambda one: (one.coverage.high, one.trait, one.family)))


def _families(machines: Sequence[Machine]) -> Iterator[tuple[str, str, BoolArray]]:
    """Yields trait, name and members of each family that is large enough, as are the others."""
    for trait in sorted({trait for machine in machines for trait in machine.traits}):
        names = [machine.traits.get(trait) for machine in machines]
        for family in sorted({name for name in names if name is not None}):
            inside = np.array([name == family for name in names])
            if LEAST_MACHINES <= inside.sum() <= len(machines) - LEAST_MACHINES:
                yield trait, family, inside


def _left_out(
    machines: Sequence[Machine],
    choices: Choices,
    start: Constants,
    trait: str,
    family: str,
    inside: BoolArray,
) -> LeftOut:
    # Ten constants have next to no part in the scores of the machines they were fitted on, so the
    # same machines give the thresholds.
    constants = fit(choices.of(~inside), start).constants
    answers = ranked(machines, probabilities(choices, constants))
    limits = thresholds([one for one, its in zip(answers, inside, strict=True) if not its])
    own = [one for one, its in zip(answers, inside, strict=True) if its]
    promised = float(np.mean([LEVELS[one.machine.measured] for one in own]))
    return LeftOut(
        trait,
        family,
        promised,
        share("truth in the set", [holds(one, limits) for one in own], Range(least=promised)),
        mean("answers in the set, mean", [float(size(one, limits)) for one in own]),
        share("first answer true", [bool(one.true[0]) for one in own]),
        reliability("first answer", first_answers(own)),
    )
