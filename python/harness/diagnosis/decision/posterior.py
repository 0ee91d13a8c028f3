# SPDX-License-Identifier: MIT
"""Probabilities of the sets of effects, of none, and of a cause outside of the catalogue.

The score of a set S of k laws (`law_count`), nats, is

    u(S) = -EVIDENCE left(S) - k EFFECT - SMALL sum_i max(0, 1 - margin_i)

with left(S) from `evidence`, and the margin of an effect: ln of the factor by which it is larger
than what every servo has. With the best score u* of all sets, of which S* has it, the score of a
cause outside of the catalogue is

    u(outside) = u* + OUTSIDE + OUTSIDE_LEFT ln(left(S*) + LEAST_LEFT)
                 + OUTSIDE_EXPLAINED (left(none) - left(S*))

with OUTSIDE_BESIDE for OUTSIDE where S* has effects, and OUTSIDE_POSITION more where no pressure is
measured. The probabilities are exp(u), divided by their sum, of which the share LAPSE is spread
over all hypotheses alike: a conditional logit (D. McFadden, in Frontiers in Econometrics, 1974),
whose constants were fitted on machines with a known cause.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray
from ..model.case import Case
from ..search.candidates import FittedCandidate
from ..search.families import effect_families, law_count
from ..search.seen_edges import edges_can_replace_force
from ..search.sizes import margin, matters
from .constants import IN_USE, Constants
from .evidence import left

# Nats beyond which more evidence makes no difference; its exponential is finite.
MOST_EVIDENCE = 500.0


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of effects as the cause of the gap; the empty set: nothing is missing.

    Attributes
    ----------
    candidate
        the fit of the set.
    left
        errors that it leaves, as `evidence.left` gives them.
    small
        sum over its effects of max(0, 1 - margin).
    probability
        probability of the set, 0 to 1.
    """

    candidate: FittedCandidate
    left: float
    small: float
    probability: float

    @property
    def families(self) -> frozenset[str]:
        """The effects, with all laws of friction counted as one."""
        return effect_families(self.candidate.effects)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Probabilities of all hypotheses; together they are 1.

    Attributes
    ----------
    hypotheses
        the calibrated rig and the sets of effects that are large enough to have a name, most
        probable first.
    outside
        probability of a cause outside of the catalogue.
    """

    hypotheses: tuple[Hypothesis, ...]
    outside: float

    @property
    def healthy(self) -> Hypothesis:
        """The hypothesis that no effect is missing."""
        return next(each for each in self.hypotheses if not each.candidate.effects)

    def by_families(self) -> list[tuple[frozenset[str], float]]:
        """Probability of each set of families, most probable first; the empty one: nothing."""
        total: dict[frozenset[str], float] = {}
        for each in self.hypotheses:
            total[each.families] = total.get(each.families, 0.0) + each.probability
        return sorted(total.items(), key=lambda item: -item[1])

    def first_of(self, families: frozenset[str]) -> Hypothesis:
        """The most probable hypothesis with these families."""
        return next(each for each in self.hypotheses if each.families == families)

    def of_effect(self, effect: str) -> float:
        """Probability that the machine has an effect, with all laws of friction as one."""
        family = effect_families((effect,))
        total = sum(each.probability for each in self.hypotheses if family <= each.families)
        return min(total, 1.0)  # rounding


def with_law(posterior: Posterior, evidence: float, constants: Constants = IN_USE) -> Posterior:
    """Returns the probabilities after a law without a name was found.

    A cause outside of the catalogue is as probable as such a law is beside the rig without effects,
    or as it was before, whichever is more. evidence: of the law against that rig, nats, its prior
    cost included.
    """
    law = posterior.healthy.probability * math.exp(min(evidence, MOST_EVIDENCE))
    others = 1.0 - posterior.outside
    # The share LAPSE stays with the other answers, however much evidence there is.
    outside = max(posterior.outside, min(law / (others + law), 1.0 - constants.lapse))
    rest = (1.0 - outside) / others
    return Posterior(
        tuple(replace(each, probability=rest * each.probability) for each in posterior.hypotheses),
        outside,
    )


def score(
    left: npt.ArrayLike,
    laws: npt.ArrayLike,
    small: npt.ArrayLike,
    constants: Constants = IN_USE,
) -> FloatArray:
    """Scores u(S), nats, of sets of so many laws; the three arrays have one shape."""
    evidence = constants.evidence * np.asarray(left)
    prior = constants.effect * np.asarray(laws) + constants.small * np.asarray(small)
    # u(S) = -EVIDENCE left(S) - k EFFECT - SMALL sum_i max(0, 1 - margin_i)
    return np.asarray(-evidence - prior)


def outside_score(
    best: npt.ArrayLike,
    left_by_best: npt.ArrayLike,
    left_by_none: npt.ArrayLike,
    pressures: npt.ArrayLike,
    constants: Constants = IN_USE,
) -> FloatArray:
    """Scores u(outside), nats, beside the best sets; the four arrays have one shape.

    best: score of the best set; it has effects where it leaves less than the calibrated rig does.
    pressures: whether a pressure is measured.
    """
    explained = np.asarray(left_by_none) - np.asarray(left_by_best)
    base = np.where(explained > 0.0, constants.outside_beside, constants.outside)
    position = np.where(pressures, 0.0, constants.outside_position)
    by_left = constants.outside_left * np.log(np.asarray(left_by_best) + constants.least_left)
    by_explained = constants.outside_explained * explained
    # u(outside) = u* + OUTSIDE + OUTSIDE_LEFT ln(left(S*) + LEAST_LEFT)
    #              + OUTSIDE_EXPLAINED (left(none) - left(S*))
    return np.asarray(np.asarray(best) + base + position + by_left + by_explained)


def probabilities_of(scores: FloatArray, constants: Constants = IN_USE) -> FloatArray:
    """Probabilities (..., K) from the scores u, nats, of K hypotheses; 0 where a score is -inf."""
    weights = np.exp(scores - scores.max(axis=-1, keepdims=True))
    shares = weights / weights.sum(axis=-1, keepdims=True)
    exists = np.isfinite(scores)
    lapse = constants.lapse / exists.sum(axis=-1, keepdims=True)
    # p = (1 - LAPSE) exp(u) / sum exp(u) + LAPSE / K
    return np.where(exists, (1.0 - constants.lapse) * shares + lapse, 0.0)


def posterior(
    case: Case, calibrated: FittedCandidate, refined: Sequence[FittedCandidate]
) -> Posterior:
    """Returns the probabilities of the calibrated rig and of the refined sets of effects.

    Sets with an effect that is no larger than in every servo are left out, and so are load forces
    that edges of the valve can replace: the smaller set stands for them.
    """
    named = [
        candidate
        for candidate in refined
        if candidate.effects
        and all(matters(effect, candidate.values, case.rig) for effect in candidate.effects)
        and not edges_can_replace_force(case, candidate)
    ]
    candidates = [calibrated, *named]
    lefts = [left(case, candidate) for candidate in candidates]
    smalls = [
        sum(
            (
                max(0.0, 1.0 - margin(effect, candidate.values, case.rig))
                for effect in candidate.effects
            ),
            start=0.0,
        )
        for candidate in candidates
    ]
    scores = score(lefts, [law_count(candidate.effects) for candidate in candidates], smalls)
    best = int(np.argmax(scores))
    outside = float(outside_score(scores[best], lefts[best], lefts[0], case.pressures))
    probabilities = probabilities_of(np.array([*scores, outside]))
    hypotheses = [
        Hypothesis(*each)
        for each in zip(candidates, lefts, smalls, probabilities[:-1].tolist(), strict=True)
    ]
    hypotheses.sort(key=lambda each: -each.probability)
    return Posterior(tuple(hypotheses), float(probabilities[-1]))
