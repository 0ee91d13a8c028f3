# SPDX-License-Identifier: MIT
"""Selection of the set of effects that the data require, and of those they cannot tell from it.

Sets of effects and gaps as words of a sentence.

Standing of each candidate beside the named set, with the reason; it only reads the selection.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ...catalogue.families import effect_families
from ...catalogue.parameters import effects, plain_name, size_name
from ...catalogue.spellings import ParameterKey
from ...rigs import Rig
from ..deciding import TOLD
from ..model.case import Case
from ..search.candidates import FittedCandidate
from ..search.intervals import likelihood_gain, matters, simpler_part, too_large
from ..search.search import SearchResult
from .hypotheses import Answer, Hypothesis, Posterior, least_loss

# A cause is called open where all other answers together are as probable as one in five.
OPEN = 0.2


def in_words(effects: Sequence[str]) -> str:
    """Returns the ids of effects as a list in words."""
    words = [plain_name(effect) for effect in effects]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def percent(gap: float) -> str:
    """Returns a gap in per cent, with two digits; from 100 % on, with all before the point."""
    in_percent = 100.0 * gap
    # The flag "#" keeps zeros at the end: 1.0 beside 0.78.
    return f"{in_percent:#.2g} %" if 0.0 < in_percent < 9.95 else f"{in_percent:.0f} %"


def chance(probability: float) -> str:
    """Returns a probability in per cent; none is told that is below 0.1 % or above 99 %."""
    if probability < 0.001:
        return "less than 0.1 %"
    return percent(probability) if probability <= 0.99 else "more than 99 %"


@dataclass(frozen=True, eq=False)
class Selection:
    """The answer that loses least, and the candidates that belong to it."""

    best: FittedCandidate
    """The calibrated rig with the effects that are named; without any where none is."""
    equivalent: tuple[FittedCandidate, ...]
    """Other sets that the data cannot separate from `best`, most probable first."""
    answer: Answer
    posterior: Posterior
    """The answer, and the probabilities that it follows from."""

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
        return tuple(self.posterior.first_of(families).fit for families in probable)

    def hypothesis(self, candidate: FittedCandidate) -> Hypothesis | None:
        """Returns the hypothesis of a candidate; None where it is too small to be one."""
        return next((each for each in self.posterior.sets if each.candidate is candidate), None)


def select_effects(
    search_result: SearchResult, probabilities: Posterior, *, unnamed: bool = False
) -> Selection:
    """Chooses the answer that loses least under the probabilities of all hypotheses.

    unnamed: whether effects that a user's simulator cannot be given could look like those of the
    best set. Beside a cause outside none is then named.
    """
    answer = least_loss(probabilities)
    if answer.kind == "outside" and unnamed:
        answer = Answer("outside", (), answer.loss)
    named = [each.fit for each in answer.named]
    best = named[0] if named else search_result.calibrated
    return Selection(best, tuple(named[1:]), answer, probabilities)


StandingKind = Literal[
    "named",
    "equivalent",
    "sufficient",
    "not_sufficient",
    "improbable",
    "not_needed",
    "too_small",
    "worse",
    "screened",
]


@dataclass(frozen=True)
class Standing:
    """What the decision made of a candidate, as `schema.Candidate` has it.

    `why` is the condition that decided, as a clause; empty where `kind` says all.
    """

    kind: StandingKind
    why: str


def standing(
    case: Case, search_result: SearchResult, selection: Selection, candidate: FittedCandidate
) -> Standing:
    """Returns the standing of a candidate and what decided it.

    Parameters
    ----------
    case, search_result
        rig and records, and all candidates that were fitted.
    selection
        the selected set and its equivalents.
    candidate
        any candidate of the search.
    """
    best = selection.best
    hypothesis = selection.hypothesis(candidate)
    is_outside = selection.answer.kind == "outside"
    if candidate is best and best.effects:
        return Standing("named", "")
    if candidate is best:
        return Standing("not_sufficient" if is_outside else "sufficient", "")
    if any(candidate is other for other in search_result.screened):
        return Standing("screened", "others gained more by a short fit")
    if hypothesis is None:
        return Standing("too_small", _why_too_small(case, candidate))
    why = f"its probability is {chance(hypothesis.probability)}"
    if any(candidate is other for other in selection.equivalent):
        return Standing("equivalent", why)
    relative = likelihood_gain(case, best, candidate).relative
    if relative > 0.0:
        return Standing("worse", f"{_how_much_worse(relative)}; {why}")
    if is_outside and not best.effects:
        return Standing("improbable", f"{why}, and below {100.0 * TOLD:.0f} % a name is a guess")
    return Standing(
        "not_needed",
        f"{why}: errors that are {100.0 * -math.expm1(relative):.2g} % smaller do not outweigh "
        "what each effect costs",
    )


def _why_too_small(case: Case, candidate: FittedCandidate) -> str:
    reasons = [
        _why_no_name(effect, candidate.values, case.rig)
        for effect in candidate.effects
        if not matters(effect, candidate.values, case.rig)
    ]
    if reasons:
        return "; ".join(reasons)
    return "the rod hardly ever leaves this contact, which is a load spring then"


def _why_no_name(effect: str, values: Mapping[str, float], rig: Rig) -> str:
    """Says what of an effect is too small, or too large, to be named."""
    name, simple = in_words([effect]), simpler_part(effect, values, rig)
    if simple is None:
        return f"{name} of this size is part of every servo"
    if too_large(effect, values, rig):
        return (
            f"no servo has {name} of these sizes ({_sizes(effect, values)}), and "
            f"{in_words([simple])}, which it contains, is judged by itself; the limits are: "
            f"{effects()[effect].least_size}"
        )
    return f"{name} differs from {in_words([simple])} by no more than in every servo"


def _sizes(effect: str, values: Mapping[str, float]) -> str:
    """Returns the sizes of an effect in words, with units."""
    told = []
    for parameter in effects()[effect].parameters:
        key = ParameterKey.of_effect(effect, parameter.name)
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        told.append(f"{size_name(key)} {values[key]:.5g}{unit}")
    return ", ".join(told)


def _how_much_worse(relative: float) -> str:
    ratio = math.exp(min(relative, 50.0))
    if ratio < 2.0:
        return f"its errors on held-out data are {100.0 * (ratio - 1.0):.2g} % larger"
    return f"its errors on held-out data are {ratio:.3g} times as large"
