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

Of a user's simulator, and where the command moves between samples, left(S) in u(S) has a narrower
tolerance where the best set shows it to be enough (`share_of_tolerance`). Of a user's simulator
UNCARRIED left(S*) / left(none) is added to u(outside), in proportion to the effects that it cannot
be given.

The constants of the probabilities as one value, so that others can be put in their place.

Errors that a candidate leaves in all data, on the scale of what is tolerated.

Intervals that hold between machines, and not only between the windows of one machine.

Gradients and bootstraps over windows tell how much a figure scatters on one machine. They do not
tell by how much machines differ from the simulator, nor how a gap on another motion differs from
the one on the record. The ends of an interval move outwards by distances at which 90 % of the
intervals held the truth on generated machines (Y. Romano, E. Patterson, E. Candès, Conformalized
quantile regression, NeurIPS 2019); `ehsid gap-calibrate` computes them.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
from msgspec.structs import replace as replace_struct

from ...base.numbers import FloatArray
from ...catalogue.spellings import ParameterKey
from ..deciding import (
    EFFECT,
    EVIDENCE,
    LAPSE,
    LEAST_LEFT,
    LEAST_SHARE,
    OCTAVES_WITHIN,
    OUTSIDE,
    OUTSIDE_BESIDE,
    OUTSIDE_EXPLAINED,
    OUTSIDE_LEFT,
    OUTSIDE_POSITION,
    SMALL,
)
from ..model.case import Case
from ..model.parameters import Parameter
from ..model.spectrum import OutputLikelihood
from ..schema import Estimate, HowFar, Value
from ..search.candidates import FittedCandidate, effect_families, law_count
from ..search.intervals import margin, matters
from ..search.maps import edges_can_replace_force
from .inside import uncarried_odds


@dataclass(frozen=True)
class Constants:
    """Constants of the equations of `posterior`; `deciding` has the reasons."""

    evidence: float
    """Number of independent errors, > 0."""
    least_left: float
    """Errors below which a simulator is as good as perfect, ln over what is tolerated, > 0."""
    effect: float
    small: float
    """Prior cost of a law, and further cost of an effect that is no larger than in every servo,
    nats."""
    outside: float
    outside_beside: float
    """Odds of a cause outside of the catalogue without and with an effect in the best set, nats."""
    outside_left: float
    outside_explained: float
    """Increase of these odds with the ln of the errors left, and with what the best set explains.
    """
    outside_position: float
    """Increase of these odds where no pressure is measured, nats."""
    lapse: float
    """Share of the probability that all answers have alike, between 0 and 1."""


IN_USE = Constants(
    evidence=EVIDENCE,
    least_left=LEAST_LEFT,
    effect=EFFECT,
    small=SMALL,
    outside=OUTSIDE,
    outside_beside=OUTSIDE_BESIDE,
    outside_left=OUTSIDE_LEFT,
    outside_explained=OUTSIDE_EXPLAINED,
    outside_position=OUTSIDE_POSITION,
    lapse=LAPSE,
)


Data = Literal["all", "fitted", "held out"]

# What a simulation that diverges leaves: more than any errors that are finite.
DIVERGED = math.log(sys.float_info.max)


def left(case: Case, candidate: FittedCandidate, data: Data = "all", share: float = 1.0) -> float:
    """Mean of ln(errors / tolerated errors) over all octaves, windows and outputs, >= 0.

        left = sum_b (n_b / 2) ln((P_b + t_b) / t_b) / sum_b n_b

    with the power P_b of the errors in band b, the tolerated power t_b and the number n_b of
    independent coefficients, over all outputs: the negative log-likelihood of `model.likelihood`,
    less that of a perfect simulator, for each independent error. A mean and not a sum, because
    errors of a model repeat. It is DIVERGED where a simulation diverges. data: which records or
    blocks count. share: of the tolerance, see `share_of_tolerance`.
    """
    cost, count = 0.0, 0.0
    for mean, likelihood in _by_output(case, candidate, data):
        narrowed = likelihood.narrowed(share)
        cost += narrowed.cost_of(mean) - narrowed.cost_of(np.zeros_like(mean))
        count += float(likelihood.counts.sum())
    return cost / count if math.isfinite(cost) else DIVERGED


def _by_output(
    case: Case, candidate: FittedCandidate, data: Data
) -> Iterator[tuple[FloatArray, OutputLikelihood]]:
    """Mean power of the errors in each band, shape (BANDS,), and the likelihood of each output."""
    for part, powers in (("fitted", candidate.fit_powers), ("held out", candidate.powers)):
        if data not in ("all", part):
            continue
        likelihoods = case.problem(held_out=part == "held out").likelihoods.values()
        for by_band, likelihood in zip(powers.sum(axis=0), likelihoods, strict=True):
            yield by_band / np.maximum(likelihood.spectrum.sizes, 1.0), likelihood


def share_of_tolerance(case: Case, candidates: Sequence[FittedCandidate]) -> float:
    """Share of a tolerance that may be too large which the best candidate shows to be enough.

    It is that of a user's simulator, or of commands that nobody logged. In each band where it is
    above the noise, what the candidate leaves above the noise is compared with it; `OCTAVES_WITHIN`
    of all bands are within the share. 1 for our simulator on a log of all commands, and where the
    rig file states the tolerance.
    """
    stated = case.engine is not None and case.engine.runs.section.tolerance is not None
    if stated or (case.engine is None and not any(case.unknown.values())):
        return 1.0
    best = min(candidates, key=lambda candidate: left(case, candidate))
    shares: list[float] = []
    for mean, likelihood in _by_output(case, best, "all"):
        assert likelihood.of_motion is not None
        noise = likelihood.tolerated - likelihood.of_motion
        told = (likelihood.of_motion > noise) & (likelihood.counts > 0.0)
        above = np.maximum(mean - noise, 0.0)[told]
        shares += np.sqrt(above / likelihood.of_motion[told]).tolist()
    most = float(np.quantile(shares, OCTAVES_WITHIN)) if shares else 1.0
    return min(max(most, LEAST_SHARE), 1.0)


# Distances by which intervals of 90 % had to be wider to hold on 1,000 generated machines, at the
# low and the high end, with pressures (True) and with the position alone (False); see
# docs/gap/calibration.md. Of sizes of effects they are shares of
# the size, of shrinkage they are shrinkage.
SIZE_FURTHER = {True: (0.039, 0.014), False: (0.105, 0.033)}
SHRINKAGE_FURTHER = {True: (0.297, 0.253), False: (0.363, 0.367)}
SHRINKAGE_FURTHER_FROM_NOMINAL = {True: (0.169, 0.139), False: (0.357, 0.079)}


def size_between_machines(estimate: Estimate, parameter: Parameter, pressures: bool) -> Estimate:
    """Returns the estimate of a parameter of an effect with an interval that holds on any machine.

    The ends stay within the bounds of the parameter. Other parameters stay as they are.
    """
    if ParameterKey(parameter.name).effect is None:
        return estimate
    size = abs(estimate.value)
    low, high = (size * distance for distance in SIZE_FURTHER[pressures])
    ends = parameter.value(parameter.low), parameter.value(parameter.high)
    return Estimate(
        estimate.value,
        max(estimate.low - low, min(ends)),
        min(estimate.high + high, max(ends)),
    )


def reduction_between_machines(reduction: HowFar, pressures: bool) -> HowFar:
    """Returns the reduction of the gap by effects, with intervals for other motions."""
    of_explainable = _further(reduction.shrinkage_of_explainable, SHRINKAGE_FURTHER[pressures])
    from_nominal = _further(
        reduction.shrinkage_from_nominal, SHRINKAGE_FURTHER_FROM_NOMINAL[pressures]
    )
    return replace_struct(
        reduction, shrinkage_of_explainable=of_explainable, shrinkage_from_nominal=from_nominal
    )


def _further(share: Value, distances: tuple[float, float]) -> Value:
    """Moves the ends of a share outwards; no more than the whole gap can vanish."""
    low, high = share.ci90
    return Value(share.value, (low - distances[0], max(high, min(high + distances[1], 1.0))))


# Nats beyond which more evidence makes no difference; its exponential is finite.
MOST_EVIDENCE = 500.0


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of effects as the cause of the gap; the empty set: nothing is missing."""

    candidate: FittedCandidate
    """The fit of the set."""
    left: float
    """Errors that it leaves, as `evidence.left` gives them."""
    small: float
    """Sum over its effects of max(0, 1 - margin)."""
    probability: float
    """Probability of the set, 0 to 1."""

    @property
    def families(self) -> frozenset[str]:
        """The effects, with all laws of friction counted as one."""
        return effect_families(self.candidate.effects)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Probabilities of all hypotheses; together they are 1."""

    hypotheses: tuple[Hypothesis, ...]
    """The calibrated rig and the sets of effects that are large enough to have a name, most
    probable first."""
    outside: float
    """Probability of a cause outside of the catalogue."""
    share: float = 1.0
    """Share of the tolerance with which the errors were counted, see `share_of_tolerance`."""
    beside: frozenset[str] = frozenset()
    beside_probability: float = 0.0
    """Families of effects beside a law without a name, and their probability where the cause is
    outside."""

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
        if family <= self.beside:
            total += self.outside * self.beside_probability
        return min(total, 1.0)  # rounding


def with_law(
    posterior: Posterior,
    evidence: float,
    effects: Sequence[str] = (),
    share: float = 1.0,
    constants: Constants = IN_USE,
) -> Posterior:
    """Returns the probabilities after a law without a name was found.

    A cause outside of the catalogue is as probable as such a law is beside the rig without effects,
    or as it was before, whichever is more.

    Parameters
    ----------
    evidence
        of the law against that rig, nats, its prior cost included.
    effects, share
        effects beside the law, and the probability of these beside a law, 0 to 1.
    """
    law = posterior.healthy.probability * math.exp(min(evidence, MOST_EVIDENCE))
    others = 1.0 - posterior.outside
    # The share LAPSE stays with the other answers, however much evidence there is.
    outside = max(posterior.outside, min(law / (others + law), 1.0 - constants.lapse))
    rest = (1.0 - outside) / others
    return Posterior(
        tuple(replace(each, probability=rest * each.probability) for each in posterior.hypotheses),
        outside,
        posterior.share,
        effect_families(effects),
        share,
    )


def with_outside(posterior: Posterior, evidence: float) -> Posterior:
    """Returns the probabilities with further evidence, nats, for a cause outside."""
    others = 1.0 - posterior.outside
    grown = posterior.outside * math.exp(min(evidence, MOST_EVIDENCE))
    outside = min(grown / (others + grown), 1.0 - LAPSE)
    rest = (1.0 - outside) / others if others > 0.0 else 1.0
    return Posterior(
        tuple(replace(each, probability=rest * each.probability) for each in posterior.hypotheses),
        outside,
        posterior.share,
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
    share = share_of_tolerance(case, candidates)
    lefts = [left(case, candidate, share=share) for candidate in candidates]
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
    # How much is left at all is measured with the whole tolerance, whatever tells the sets apart,
    # and without what nobody can tell of a rod that sticks and slips.
    steady = case.with_lost_motion(candidates[best].effects, candidates[best].x)
    of_best, of_none = (left(steady, candidates[place]) for place in (best, 0))
    outside = float(outside_score(scores[best], of_best, of_none, case.pressures))
    # An effect that cannot be tried is the less probable, the more another one explains.
    outside += uncarried_odds(case.rig) * (of_best / of_none if of_none > 0.0 else 1.0)
    probabilities = probabilities_of(np.array([*scores, outside]))
    hypotheses = [
        Hypothesis(*each)
        for each in zip(candidates, lefts, smalls, probabilities[:-1].tolist(), strict=True)
    ]
    hypotheses.sort(key=lambda each: -each.probability)
    return Posterior(tuple(hypotheses), float(probabilities[-1]), share)
