# SPDX-License-Identifier: MIT
"""The whole calibration: fitted constants, and how well probabilities, sets and intervals hold.

Families of structure, each left out in turn: constants and thresholds come from all others.

Machines of a family that the calibration never saw are not exchangeable with those it saw, so that
nothing is promised for them; the worst family tells how much that may matter elsewhere.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import Progress
from ehsid.harness.diagnosis.search.score import IN_USE, Constants

from ..scoring.figures import Figure, Range, mean, share
from ..scoring.judging import KNOWN
from .choices import BoolArray, Choices, IntArray, choices_of, log_loss, probabilities
from .fitting import NAMES, Fit, Ranked, fit, folds, ranked
from .intervals import (
    LEVELS,
    ClassOfSensors,
    Intervals,
    classes_of_sensors,
    holds,
    intervals,
    size,
    split_sets,
    thresholds,
)
from .machines import Found, Machine
from .reliability import Reliability, first_answers, named_effects, reliability

# Fewer machines say nothing of a coverage: the interval of 19 out of 20 is 13 % wide. As many must
# remain, or nothing can be fitted.
LEAST_MACHINES = 20


@dataclass(frozen=True)
class LeftOut:
    """A family that was left out."""

    trait: str
    family: str
    """Trait and name of the family."""
    promised: float
    """Share of its machines whose set should hold the truth, as far as they are like the others."""
    coverage: Figure
    """Share of its machines whose set holds the truth."""
    size: Figure
    """Mean number of answers in a set."""
    right: Figure
    """Share of its machines whose first answer is the truth."""
    reliability: Reliability
    """Reliability of the first answers."""


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


# Each fold holds a fifth of the machines: the usual compromise between fits on nearly all machines
# and thresholds from enough of them.
FOLDS = 5
SEED = 1


@dataclass(frozen=True)
class Constant:
    """A constant of the probabilities."""

    name: str
    """Its name in `diagnosis.deciding`, in small letters."""
    in_use: float
    fitted: float
    error: float
    """Value in use, fitted value and standard error of the latter."""
    deviation: float
    """Fitted less in use, in standard errors."""


@dataclass(frozen=True)
class Probabilities:
    """How good the probabilities of some constants are."""

    words: str
    """Which constants."""
    log_loss: Figure
    """Mean of -ln of the probability of the truth, nats."""
    right: Figure
    """Share of the machines whose first answer is the truth."""
    reliability: tuple[Reliability, ...]
    """Reliability of the first answers and of the effects in them."""


@dataclass(frozen=True)
class Calibration:
    """Content of `calibration.json`."""

    ehsid_version: str
    """Version of ehsid that made it."""
    machines: int
    """Number of machines."""
    kinds: Mapping[str, int]
    sensors: Mapping[str, int]
    """Number of machines by kind and by class of sensors."""
    left_out: Mapping[str, int]
    """Number of cases that were left out, by reason."""
    never_weighed: int
    """Number of machines with effects of the catalogue none of whose weighed sets is the truth."""
    constants: tuple[Constant, ...]
    """Constants in use and fitted ones."""
    probabilities: tuple[Probabilities, ...]
    """Quality of the probabilities: with the constants in use, and with fitted ones, where each
    machine was left out of the fit."""
    sets: tuple[ClassOfSensors, ...]
    """Sets of answers by class of sensors."""
    intervals: tuple[Intervals, ...]
    """Intervals of sizes and of promised shrinkage by class of sensors."""
    families: tuple[LeftOut, ...]
    """Families that were left out, the worst first."""


def calibrate(found: Found, progress: Progress | None = None) -> Calibration:
    """Fits the constants and checks the probabilities; the same machines give the same results.

    Parameters
    ----------
    found
        machines, each with its own name, in any order.
    progress
        called with the share of the work that is done.

    Raises
    ------
    ValueError
        there are fewer machines than folds.
    """
    machines = sorted(found.machines, key=lambda machine: machine.name)
    if len(machines) < FOLDS:
        raise ValueError(
            f"{len(machines)} machines: expected at least {FOLDS}, and hundreds for a result that "
            "means something; run ehsid gap-check with a larger --count"
        )
    choices = choices_of(machines)
    parts = folds(len(machines), FOLDS, np.random.default_rng(SEED))
    whole = fit(choices)
    out_of_fold = _out_of_fold(choices, parts)
    answers = ranked(machines, out_of_fold)
    return Calibration(
        ehsid_version=ehsid.__version__,
        machines=len(machines),
        kinds=dict(sorted(Counter(machine.kind for machine in machines).items())),
        sensors=dict(sorted(Counter(machine.measured for machine in machines).items())),
        left_out=found.left_out,
        never_weighed=sum(machine.kind in KNOWN and machine.outside for machine in machines),
        constants=_constants(whole),
        probabilities=(
            _probabilities("constants in use", machines, choices, probabilities(choices, IN_USE)),
            _probabilities("fitted, machine left out", machines, choices, out_of_fold),
        ),
        sets=classes_of_sensors(split_sets(machines, choices, parts), answers),
        intervals=intervals(machines),
        families=left_out_families(machines, choices, whole.constants, progress),
    )


def _constants(whole: Fit) -> tuple[Constant, ...]:
    found = []
    for name, error in zip(NAMES, whole.errors.tolist(), strict=True):
        in_use, fitted = getattr(IN_USE, name), getattr(whole.constants, name)
        found.append(Constant(name, in_use, fitted, error, (fitted - in_use) / error))
    return tuple(found)


def _out_of_fold(choices: Choices, parts: Sequence[IntArray]) -> FloatArray:
    """Probabilities (N, M + 1) of each machine with constants that were fitted without its fold."""
    found = np.empty(choices.true.shape)
    for part in parts:
        others = np.setdiff1d(np.arange(len(found)), part)
        found[part] = probabilities(choices.of(part), fit(choices.of(others)).constants)
    return found


def _probabilities(
    words: str, machines: Sequence[Machine], choices: Choices, chances: FloatArray
) -> Probabilities:
    answers: list[Ranked] = ranked(machines, chances)
    return Probabilities(
        words,
        mean("log loss", log_loss(chances, choices.true).tolist(), unit="nats"),
        share("first answer true", [bool(one.true[0]) for one in answers]),
        (
            reliability("first answer", first_answers(answers)),
            reliability("each effect of the first answer", named_effects(answers)),
        ),
    )
