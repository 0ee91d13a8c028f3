# SPDX-License-Identifier: MIT
"""The whole calibration: fitted constants, and how well probabilities, sets and intervals hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import ehsid
from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.base.parallel import Progress
from ehsid.harness.diagnosis.decision.constants import IN_USE

from ..scoring.figures import Figure, mean, share
from ..scoring.judging import KNOWN
from .choices import Choices, IntArray, choices_of, log_loss, probabilities
from .conformal import ClassOfSensors, classes_of_sensors, split_sets
from .fitting import NAMES, Fit, fit, folds
from .intervals import Intervals, intervals
from .left_out import LeftOut, left_out_families
from .machines import Machine
from .ranking import Ranked, ranked
from .reading import Found
from .reliability import Reliability, first_answers, named_effects, reliability

# Each fold holds a fifth of the machines: the usual compromise between fits on nearly all machines
# and thresholds from enough of them.
FOLDS = 5
SEED = 1


@dataclass(frozen=True)
class Constant:
    """A constant of the probabilities.

    Attributes
    ----------
    name
        its name in `diagnosis.deciding`, in small letters.
    in_use, fitted, error
        value in use, fitted value and standard error of the latter.
    deviation
        fitted less in use, in standard errors.
    """

    name: str
    in_use: float
    fitted: float
    error: float
    deviation: float


@dataclass(frozen=True)
class Probabilities:
    """How good the probabilities of some constants are.

    Attributes
    ----------
    words
        which constants.
    log_loss
        mean of -ln of the probability of the truth, nats.
    right
        share of the machines whose first answer is the truth.
    reliability
        reliability of the first answers and of the effects in them.
    """

    words: str
    log_loss: Figure
    right: Figure
    reliability: tuple[Reliability, ...]


@dataclass(frozen=True)
class Calibration:
    """Content of `calibration.json`.

    Attributes
    ----------
    ehsid_version
        version of ehsid that made it.
    machines
        number of machines.
    kinds, sensors
        number of machines by kind and by class of sensors.
    left_out
        number of cases that were left out, by reason.
    never_weighed
        number of machines with effects of the catalogue none of whose weighed sets is the truth.
    constants
        constants in use and fitted ones.
    probabilities
        quality of the probabilities: with the constants in use, and with fitted ones, where each
        machine was left out of the fit.
    sets
        sets of answers by class of sensors.
    intervals
        intervals of sizes and of promised shrinkage by class of sensors.
    families
        families that were left out, the worst first.
    """

    ehsid_version: str
    machines: int
    kinds: Mapping[str, int]
    sensors: Mapping[str, int]
    left_out: Mapping[str, int]
    never_weighed: int
    constants: tuple[Constant, ...]
    probabilities: tuple[Probabilities, ...]
    sets: tuple[ClassOfSensors, ...]
    intervals: tuple[Intervals, ...]
    families: tuple[LeftOut, ...]


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
