# SPDX-License-Identifier: MIT
"""All that may explain a gap, as hypotheses of one type with one posterior and one table of losses.

| hypothesis | score u, nats |
|---|---|
| nothing is missing | -EVIDENCE left with fitted values, + AGREES for a small gap as configured |
| a set of effects | that of `search.score` |
| a law without a name | that of its fit, with its prior cost (`laws.choosing`) |
| a cause outside of the catalogue, unknown | that below, and what else speaks for it |

    u(outside) = u* + OUTSIDE + OUTSIDE_LEFT ln(left(S*) + LEAST_LEFT)
                 + OUTSIDE_EXPLAINED (left(none) - left(S*))

S* is the set with the best score u*; OUTSIDE_BESIDE stands for OUTSIDE where it has effects, and
OUTSIDE_POSITION is added where no pressure is measured. The probabilities are exp(u), divided by
their sum, of which the share LAPSE is spread over all hypotheses alike: a conditional logit (D.
McFadden, in Frontiers in Econometrics, 1974), whose constants were fitted on machines with a known
cause.

The answer is the one that loses least:

| answer | truth: nothing is missing | this set | another set | outside |
|---|---|---|---|---|
| nothing is missing | 0 | - | MISSED | MISSED |
| a set of effects | FALSE_ALARM | 0 | WRONG_NAME, or MISSED | WRONG_NAME |
| m sets | FALSE_ALARM | (m - 1) FURTHER_MEMBER | SET_WITHOUT_TRUTH | SET_WITHOUT_TRUTH |
| outside of the catalogue | FALSE_ALARM | - | NEEDLESS_OUTSIDE | 0 |

A set that has an effect of the true one misses the others; else it is a wrong name. All laws of
friction count as one effect. A law without a name is a cause outside. An answer that is less
probable than TOLD is not given.

Values that are not those of the rig file within their uncertainty cost VALUES at most, whatever the
set, and so does an unusual servo, see `score.price_of_values`. Where nothing is missing, this price
tells how probable it is that values differ. One question stands beside these: does the position
come in steps? The record itself shows that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...catalogue.families import effect_families, law_count
from ..deciding import (
    AGREES,
    FALSE_ALARM,
    FURTHER_MEMBER,
    MISSED,
    NEEDLESS_OUTSIDE,
    SET_WITHOUT_TRUTH,
    TOLD,
    WRONG_NAME,
)
from ..model.case import Case
from ..search.candidates import FittedCandidate
from ..search.intervals import matters
from ..search.refit import FittedToAll
from ..search.score import (
    IN_USE,
    NO_PRICE,
    Constants,
    Price,
    always_touches,
    left,
    price_of_values,
    score,
    share_of_tolerance,
    smallness,
)
from .inside import uncarried_odds

Kind = Literal["nothing", "effects", "law", "outside"]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation of the gap."""

    kind: Kind
    score: float
    """u, nats; only differences count."""
    effects: tuple[str, ...] = ()
    """The effects, or those beside a cause outside; none where nothing is missing."""
    candidate: FittedCandidate | None = None
    """The fit of the set; None for a law, and for a cause of which nothing is known."""
    left: float = 0.0
    small: float = 0.0
    """Errors that the set leaves, and the sum over its effects of max(0, 1 - margin)."""
    price: Price = NO_PRICE
    """Of its values, see `score.price_of_values`."""
    probability: float = 0.0
    """0 to 1."""

    @property
    def families(self) -> frozenset[str]:
        """The effects, with all laws of friction counted as one."""
        return effect_families(self.effects)

    @property
    def fit(self) -> FittedCandidate:
        """The fit of a set of effects, or of the rig without any."""
        assert self.candidate is not None
        return self.candidate


@dataclass(frozen=True, eq=False)
class Posterior:
    """Probabilities of all hypotheses; together they are 1."""

    hypotheses: tuple[Hypothesis, ...]
    """Most probable first."""
    share: float = 1.0
    """Share of the tolerance with which the errors were counted, see `share_of_tolerance`."""
    agreement: float = 0.0
    """Evidence that nothing is missing, in its score, nats: AGREES, or none."""

    @property
    def sets(self) -> tuple[Hypothesis, ...]:
        """The calibrated rig and the sets of effects that are large enough to have a name."""
        return tuple(each for each in self.hypotheses if each.kind in ("nothing", "effects"))

    @property
    def healthy(self) -> Hypothesis:
        """The hypothesis that no effect is missing."""
        return next(each for each in self.hypotheses if each.kind == "nothing")

    @property
    def outside(self) -> float:
        """Probability of a cause outside of the catalogue, be it a law that was found or not."""
        return sum(each.probability for each in self.hypotheses if each.kind in ("law", "outside"))

    def by_families(self) -> list[tuple[frozenset[str], float]]:
        """Probability of each set of families, most probable first; the empty one: nothing."""
        total: dict[frozenset[str], float] = {}
        for each in self.sets:
            total[each.families] = total.get(each.families, 0.0) + each.probability
        return sorted(total.items(), key=lambda item: -item[1])

    def first_of(self, families: frozenset[str]) -> Hypothesis:
        """The most probable set with these families."""
        return next(each for each in self.sets if each.families == families)

    def of_effect(self, effect: str) -> float:
        """Probability that the machine has an effect, with all laws of friction as one."""
        family = effect_families((effect,))
        total = sum(each.probability for each in self.hypotheses if family <= each.families)
        return min(total, 1.0)  # rounding

    def with_evidence(self, nats: float, beside: tuple[str, ...] = ()) -> Posterior:
        """Returns the probabilities with further evidence, nats, for an unknown cause outside.

        beside: effects beside which the cause is seen.
        """
        return weighed(
            [
                replace(each, score=each.score + nats, effects=beside)
                if each.kind == "outside"
                else each
                for each in self.hypotheses
            ],
            self.share,
            self.agreement,
        )

    def with_agreement(self) -> Posterior:
        """Returns the probabilities where the simulator as configured nearly agrees."""
        sound = self.healthy
        others = [each for each in self.hypotheses if each is not sound]
        return weighed([*others, replace(sound, score=sound.score + AGREES)], self.share, AGREES)

    def with_laws(self, laws: Sequence[tuple[Sequence[str], float]]) -> Posterior:
        """Returns the probabilities with laws without a name as further hypotheses.

        laws: of each the effects beside it, and its evidence against the rig without effects whose
        values cost nothing, nats, its prior cost included.
        """
        nothing = self.healthy.score + self.healthy.price.total - self.agreement
        further = [
            Hypothesis("law", nothing + evidence, tuple(effects)) for effects, evidence in laws
        ]
        return weighed([*self.hypotheses, *further], self.share, self.agreement)


def weighed(
    hypotheses: Sequence[Hypothesis], share: float = 1.0, agreement: float = 0.0
) -> Posterior:
    """Returns hypotheses with the probabilities that follow from their scores."""
    probabilities = probabilities_of(np.array([each.score for each in hypotheses]))
    with_their_own = [
        replace(each, probability=probability)
        for each, probability in zip(hypotheses, probabilities.tolist(), strict=True)
    ]
    ranked = sorted(with_their_own, key=lambda each: -each.probability)
    return Posterior(tuple(ranked), share, agreement)


def probabilities_of(scores: FloatArray, constants: Constants = IN_USE) -> FloatArray:
    """Probabilities (..., K) from the scores u, nats, of K hypotheses; 0 where a score is -inf."""
    weights = np.exp(scores - scores.max(axis=-1, keepdims=True))
    shares = weights / weights.sum(axis=-1, keepdims=True)
    exists = np.isfinite(scores)
    lapse = constants.lapse / exists.sum(axis=-1, keepdims=True)
    # p = (1 - LAPSE) exp(u) / sum exp(u) + LAPSE / K
    return np.where(exists, (1.0 - constants.lapse) * shares + lapse, 0.0)


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


def posterior(
    case: Case,
    calibrated: FittedCandidate,
    refined: Sequence[FittedCandidate],
    together: Sequence[FittedToAll] = (),
) -> Posterior:
    """Returns the probabilities of the calibrated rig, of the refined sets, and of a cause outside.

    together: the likely ones with their values fitted to all data; what they leave counts. The
    price of the values of the others is that with the values of their fit.

    Sets with an effect that is no larger than in every servo are left out: the smaller set stands
    for them. For a contact that the rod never leaves a load spring stands.
    """
    named = [
        candidate
        for candidate in refined
        if candidate.effects
        and all(matters(effect, candidate.values, case.rig) for effect in candidate.effects)
        and not always_touches(case, candidate)
    ]
    candidates = [calibrated, *named]
    of_all = {each.effects: each for each in together}
    fits = {each.effects: of_all.get(each.effects, FittedToAll(each, each)) for each in candidates}
    told = {effects: each.freely for effects, each in fits.items()}
    share = share_of_tolerance(case, list(told.values()))
    sets = []
    for each in candidates:
        leaves, small = left(case, told[each.effects], share=share), smallness(case, each)
        price = price_of_values(case, told[each.effects], fits[each.effects].held, share)
        points = float(score(leaves, law_count(each.effects), small, price.total))
        kind: Kind = "effects" if each.effects else "nothing"
        sets.append(Hypothesis(kind, points, each.effects, each, leaves, small, price))
    best = max(sets, key=lambda each: each.score)
    # How much is left at all is measured with the whole tolerance, whatever tells the sets apart,
    # and without what nobody can tell of a rod with friction.
    steady = case.with_unsteady_friction(best.effects, told[best.effects].x)
    of_best, of_none = (left(steady, told[each]) for each in (best.effects, ()))
    outside = float(outside_score(best.score, of_best, of_none, case.pressures))
    # An effect that cannot be tried is the less probable, the more another one explains.
    outside += uncarried_odds(case.rig) * (of_best / of_none if of_none > 0.0 else 1.0)
    return weighed([*sets, Hypothesis("outside", outside)], share)


# Probability of what the record itself shows, such as steps of a sensor, against its contrary: no
# evidence takes the share of a lapse away.
SHOWN = float(probabilities_of(np.array([0.0, -1e3]))[0])


@dataclass(frozen=True, eq=False)
class Answer:
    """An answer to the question which effects cause the gap."""

    kind: Literal["healthy", "effects", "ambiguous", "outside"]
    """"healthy": no effect is missing; "effects": the one set of `named`; "ambiguous": one of the
    sets of `named`; "outside": a cause outside of the catalogue, beside the set of `named`, which
    may be empty."""
    named: tuple[Hypothesis, ...]
    """Sets of effects, of each family its most probable one; most probable family first."""
    loss: float
    """Expected loss."""


def least_loss(posterior: Posterior) -> Answer:
    """Returns the answer with the least expected loss under the probabilities.

    Where a cause outside and effects are both likely, "nothing is missing" can lose least although
    it is hardly possible; below TOLD it is no answer.
    """
    answers = [
        answer
        for answer in _answers(posterior)
        if answer.kind != "healthy" or posterior.healthy.probability >= TOLD
    ]
    return min(answers, key=lambda answer: answer.loss)


def _answers(posterior: Posterior) -> Iterator[Answer]:
    probability = {families: share for families, share in posterior.by_families() if families}
    sets = tuple(posterior.first_of(families) for families in probability)
    of_any = sum(probability.values())
    sound, outside = posterior.healthy.probability, posterior.outside
    yield Answer("healthy", (), MISSED * (of_any + outside))
    alarm = FALSE_ALARM * sound
    best = posterior.sets[0]
    is_told = all(posterior.of_effect(effect) >= TOLD for effect in best.effects)
    beside = (best,) if best.effects and is_told else ()
    yield Answer("outside", beside, alarm + NEEDLESS_OUTSIDE * of_any)
    for named in sets:
        others = sum(
            share * (MISSED if families & named.families else WRONG_NAME)
            for families, share in probability.items()
            if families != named.families
        )
        yield Answer("effects", (named,), alarm + others + WRONG_NAME * outside)
    for count in range(2, len(sets) + 1):
        inside = sum(probability[each.families] for each in sets[:count])
        without_truth = SET_WITHOUT_TRUTH * (of_any - inside + outside)
        further = FURTHER_MEMBER * (count - 1) * inside
        yield Answer("ambiguous", sets[:count], alarm + further + without_truth)
