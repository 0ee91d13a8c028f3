# SPDX-License-Identifier: MIT
"""Selection of the set of effects that the data require, and of those they cannot tell from it."""

from __future__ import annotations

from dataclasses import dataclass

from ..model.case import Case
from ..search.candidates import FittedCandidate
from ..search.families import effect_families
from ..search.search import SearchResult
from .decision import Answer, least_loss
from .posterior import Hypothesis, Posterior, posterior

# A cause is called open where all other answers together are as probable as one in five. An answer
# is told from one in ten on.
OPEN = 0.2
TOLD = 0.1


@dataclass(frozen=True, eq=False)
class Selection:
    """The answer that loses least, and the candidates that belong to it.

    Attributes
    ----------
    best
        the calibrated rig with the effects that are named; without any where none is.
    equivalent
        other sets that the data cannot separate from `best`, most probable first.
    answer, posterior
        the answer, and the probabilities that it follows from.
    """

    best: FittedCandidate
    equivalent: tuple[FittedCandidate, ...]
    answer: Answer
    posterior: Posterior

    @property
    def is_open(self) -> bool:
        """Whether sets other than those that are given, or outside, are probable together."""
        return sum(map(self.probability, (self.best, *self.equivalent))) < 1.0 - OPEN

    def probability(self, candidate: FittedCandidate) -> float:
        """Probability of a set, with all of its families; of the one without effects: nothing."""
        return dict(self.posterior.by_families()).get(effect_families(candidate.effects), 0.0)

    @property
    def rivals(self) -> tuple[FittedCandidate, ...]:
        """Sets that an experiment must tell from the named one, most probable first.

        Those that are equivalent; else, where the cause is open, all that are probable enough to
        be told.
        """
        if self.answer.kind != "effects" or not self.is_open:
            return self.equivalent
        named = effect_families(self.best.effects)
        probable = [
            families
            for families, share in self.posterior.by_families()
            if share >= TOLD and families != named
        ]
        return tuple(self.posterior.first_of(families).candidate for families in probable)

    def hypothesis(self, candidate: FittedCandidate) -> Hypothesis | None:
        """Returns the hypothesis of a candidate; None where it is too small to be one."""
        return next(
            (each for each in self.posterior.hypotheses if each.candidate is candidate), None
        )


def select_effects(case: Case, search_result: SearchResult) -> Selection:
    """Chooses the answer that loses least under the probabilities of all fitted sets."""
    probabilities = posterior(case, search_result.calibrated, search_result.refined)
    answer = least_loss(probabilities)
    named = [each.candidate for each in answer.named]
    best = named[0] if named else search_result.calibrated
    return Selection(best, tuple(named[1:]), answer, probabilities)
