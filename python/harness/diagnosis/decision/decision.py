# SPDX-License-Identifier: MIT
"""The answer that loses least: each possible answer costs something under each possible truth.

| answer | truth: nothing is missing | this set | another set | outside |
|---|---|---|---|---|
| nothing is missing | 0 | - | MISSED | MISSED |
| a set of effects | FALSE_ALARM | 0 | WRONG_NAME, or MISSED | WRONG_NAME |
| m sets | FALSE_ALARM | (m - 1) FURTHER_MEMBER | SET_WITHOUT_TRUTH | SET_WITHOUT_TRUTH |
| outside of the catalogue | FALSE_ALARM | - | NEEDLESS_OUTSIDE | 0 |

A set that has an effect of the true one misses the others; else it is a wrong name. All laws of
friction count as one effect.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from ..deciding import (
    FALSE_ALARM,
    FURTHER_MEMBER,
    MISSED,
    NEEDLESS_OUTSIDE,
    SET_WITHOUT_TRUTH,
    WRONG_NAME,
)
from .posterior import Hypothesis, Posterior

Kind = Literal["healthy", "effects", "ambiguous", "outside"]


@dataclass(frozen=True, eq=False)
class Answer:
    """An answer to the question which effects cause the gap.

    Attributes
    ----------
    kind
        "healthy": no effect is missing; "effects": the one set of `named`; "ambiguous": one of the
        sets of `named`; "outside": a cause outside of the catalogue, beside the set of `named`,
        which may be empty.
    named
        sets of effects, of each family its most probable one; most probable family first.
    loss
        expected loss.
    """

    kind: Kind
    named: tuple[Hypothesis, ...]
    loss: float


def least_loss(posterior: Posterior) -> Answer:
    """Returns the answer with the least expected loss under the probabilities."""
    return min(_answers(posterior), key=lambda answer: answer.loss)


def _answers(posterior: Posterior) -> Iterator[Answer]:
    healthy = posterior.healthy
    probability = {families: share for families, share in posterior.by_families() if families}
    sets = tuple(posterior.first_of(families) for families in probability)
    of_any = sum(probability.values())
    sound, outside = healthy.probability, posterior.outside
    yield Answer("healthy", (), MISSED * (of_any + outside))
    alarm = FALSE_ALARM * sound
    best = posterior.hypotheses[0]
    beside = (best,) if best.candidate.effects else ()
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
