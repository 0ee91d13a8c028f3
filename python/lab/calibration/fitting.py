# SPDX-License-Identifier: MIT
"""Maximum likelihood of the constants of the probabilities, with their standard errors.

With the derivatives dp/dx of the probabilities by the coordinates x of the constants, the gradient
of -ln p(truth) of a machine and its expected curvature, Fisher's information, are

    g = -(dp(truth)/dx) / p(truth),    F = sum over all answers (dp/dx) (dp/dx)' / p

A weak ridge keeps constants of which the machines say nothing where they are. Where the best set of
a machine changes with x, the probability of outside jumps. So the fit is done in rounds, each
beside the best sets of the one before. The standard errors are those of the sandwich,
(F + R)^-1 (sum g g' + R) (F + R)^-1 with the ridge R, which stays right where the probabilities are
only nearly those of the equation (H. White, Econometrica 50(1), 1982).

The file of features, from which constants can be fitted again without any diagnosis.

It has one machine as JSON in each line. The machines are in the order of their names.

The possible answers for a machine, most probable first, and which of them is true.

An answer is a set of effects with all laws of friction as one, nothing missing, or "outside".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import msgspec
import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit

from ehsid.harness.base.encoding import from_json
from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.families import effect_families
from ehsid.harness.diagnosis.search.score import IN_USE, Constants

from ..scoring.judging import KNOWN, is_true
from .choices import BoolArray, Choices, IntArray, best_sets, log_loss, probabilities
from .machines import Machine

FEATURES = "features.jsonl"


def write_features(path: Path, machines: Iterable[Machine]) -> None:
    """Writes the file, whole or not at all."""
    lines = [
        msgspec.json.encode(machine).decode()
        for machine in sorted(machines, key=lambda machine: machine.name)
    ]
    write_text(path, "".join(f"{line}\n" for line in lines))


def read_features(path: Path) -> list[Machine]:
    """Reads the machines of a file; empty lines are ignored.

    Raises
    ------
    ValueError
        the file cannot be read, or a line is no machine; the message names the line.
    """
    try:
        lines = path.read_bytes().splitlines()
    except FileNotFoundError:
        raise ValueError(
            f"{path}: there is no such file; expected a {FEATURES} of ehsid gap-calibrate"
        ) from None
    machines = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            machines.append(from_json(line, Machine))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise ValueError(
                f"{path}: line {number}: not a machine of {FEATURES}: {error}; restore the line, "
                "or make the file again from its checks"
            ) from None
    return machines


@dataclass(frozen=True, eq=False)
class Ranked:
    """K answers for a machine, by falling probability."""

    machine: Machine
    """The machine."""
    effects: tuple[tuple[str, ...] | None, ...]
    """Effects of each answer; None for "outside of the catalogue"."""
    chances: FloatArray
    """(K,): probabilities; their sum is 1."""
    true: BoolArray
    """(K,): whether the answer is the truth; at least one is."""

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


NAMES = tuple(each.name for each in fields(Constants))
# The logarithms of those that are larger than zero are fitted, and the logit of the lapse, which is
# between 0 and 1.
POSITIVE = np.array([name in ("evidence", "least_left") for name in NAMES])
SHARE = np.array([name == "lapse" for name in NAMES])
# Standard deviations of the ridge around the constants in use: a factor of e for those that are
# positive and for the odds of a lapse; odds of 20 to 1, 3 nats, for the others. So a constant that
# is off by that much costs half a nat, which a few machines outweigh.
RIDGE = np.where(POSITIVE | SHARE, 1.0, 3.0)
# Step of the derivatives of the probabilities. They are smooth and of order 1, so the error of
# central differences, about step^2, and that of rounding, 1e-16 / step, are both far below 1e-6.
STEP = 1e-4
# The fit ends where the gradient is below this, nats: then x is within 1e-2 of a standard error of
# the ridge, which is the largest there is.
GRADIENT = 1e-2
# The best sets mostly stay as they are after one to four rounds. Where those of a machine go to and
# fro without end, either round is right to a small part of a standard error.
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted constants, and their standard errors, (10,), in the order of `NAMES`."""

    constants: Constants
    errors: FloatArray


def coordinates(constants: Constants) -> FloatArray:
    """Returns the coordinates x of the fit, (10,): logarithm, logit, or the constant itself."""
    values = _values(constants)
    x = values.copy()
    x[POSITIVE] = np.log(values[POSITIVE])
    x[SHARE] = logit(values[SHARE])
    return x


def constants_at(x: FloatArray) -> Constants:
    """Returns the constants with the coordinates x."""
    values = x.copy()
    values[POSITIVE] = np.exp(x[POSITIVE])
    values[SHARE] = expit(x[SHARE])
    return Constants(**dict(zip(NAMES, values.tolist(), strict=True)))


def scales(constants: Constants) -> FloatArray:
    """Derivatives of the constants by their coordinates, (10,)."""
    values = _values(constants)
    # d exp(x)/dx = exp(x), and the derivative of the logistic function is p (1 - p).
    return np.where(POSITIVE, values, np.where(SHARE, values * (1.0 - values), 1.0))


def _values(constants: Constants) -> FloatArray:
    return np.array([getattr(constants, name) for name in NAMES])


def fit(choices: Choices, start: Constants = IN_USE) -> Fit:
    """Fits the constants to the machines.

    Parameters
    ----------
    choices
        sets of at least one machine.
    start
        constants from which the search starts; the ridge is around `IN_USE` in any case.
    """
    x = coordinates(start)
    best = best_sets(choices, start)
    for _ in range(ROUNDS):
        x = _fitted_beside(choices, x, best)
        before, best = best, best_sets(choices, constants_at(x))
        if np.array_equal(best, before):
            break
    constants = constants_at(x)
    gradients, curvature = _derivatives(choices, x, best, curvature=True)
    ridge = np.diag(RIDGE**-2.0)
    bread = np.linalg.inv(curvature + ridge)
    covariance = bread @ (gradients.T @ gradients + ridge) @ bread
    return Fit(constants, scales(constants) * np.sqrt(np.diag(covariance)))


def _fitted_beside(choices: Choices, start: FloatArray, best: IntArray) -> FloatArray:
    """Returns the x of least cost, (10,), where outside stands beside these sets whatever x is."""
    centre = coordinates(IN_USE)

    def cost(x: FloatArray) -> tuple[float, FloatArray]:
        away = (x - centre) / RIDGE
        losses = log_loss(probabilities(choices, constants_at(x), best), choices.true)
        # -sum ln p(truth) + 1/2 sum ((x - x_in_use) / RIDGE)^2
        value = float(losses.sum() + 0.5 * away @ away)
        gradients, _ = _derivatives(choices, x, best, curvature=False)
        return value, gradients.sum(axis=0) + away / RIDGE

    found = minimize(cost, start, jac=True, method="L-BFGS-B", options={"gtol": GRADIENT})
    return np.asarray(found.x)


def _derivatives(
    choices: Choices, x: FloatArray, best: IntArray, *, curvature: bool
) -> tuple[FloatArray, FloatArray]:
    """Gradients of -ln p(truth), (N, 10), and, if wanted, their expected curvature F, (10, 10)."""
    chances = probabilities(choices, constants_at(x), best)
    slopes = np.stack(list(_slopes(choices, x, best)), axis=-1)
    of_truth = np.where(choices.true, chances, 0.0).sum(axis=1, keepdims=True)
    # g = -sum over the truth of dp/dx / p(truth)
    gradients = -np.einsum("nm,nmk->nk", choices.true / of_truth, slopes)
    if not curvature:
        return gradients, np.zeros((x.size, x.size))
    # F = sum (dp/dx) (dp/dx)' / p over all answers that there are
    inverse = np.divide(1.0, chances, out=np.zeros_like(chances), where=chances > 0.0)
    return gradients, np.einsum("nm,nmk,nml->kl", inverse, slopes, slopes, optimize=True)


def _slopes(choices: Choices, x: FloatArray, best: IntArray) -> Iterator[FloatArray]:
    """Yields dp/dx, (N, M + 1), for each coordinate."""
    for step in STEP * np.eye(x.size):
        ahead, behind = (
            probabilities(choices, constants_at(at), best) for at in (x + step, x - step)
        )
        yield (ahead - behind) / (2.0 * STEP)


def folds(count: int, number: int, rng: np.random.Generator) -> list[IntArray]:
    """Returns the indices of the machines of each fold; sizes differ by one at most."""
    return np.array_split(rng.permutation(count), number)
