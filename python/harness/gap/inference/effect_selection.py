# SPDX-License-Identifier: MIT
"""Selection of the set of effects that the data require, and of those they cannot tell from it."""

from __future__ import annotations

from dataclasses import dataclass

from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.decision import Answer, least_loss
from ehsid.harness.gap.inference.posterior import Hypothesis, Posterior, posterior
from ehsid.harness.gap.inference.search import SearchResult
from ehsid.harness.gap.model.case import Case


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
