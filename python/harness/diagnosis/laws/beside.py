# SPDX-License-Identifier: MIT
"""Effects of the catalogue beside a law without a name.

Where a law explains most of a gap, an effect that is small beside it shows only once the law is
there: a delay of a crane's controller is no candidate as long as the lever of the boom is missing.
Each effect is tried as one linear term beside the laws, and those that promise most are fitted. And
a law that is constant is no law, but an effect.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import partial

import numpy as np

from ...base.parallel import Progress, part_of, run_together
from ...catalogue.families import law_count, repeats_a_law
from ...catalogue.parameters import effects
from ...rigs.rig import table_subsystem
from ..deciding import EFFECT, EVIDENCE
from ..model.case import Case
from ..model.fit import fit
from ..model.parameters import Law
from ..search.candidates import FitStart, FittedCandidate, evaluate, linearised_start, screen
from ..search.intervals import matters
from ..search.preselection import preselected
from ..search.score import left
from .fitting import LONG
from .forms import CONSTANTS, MASS

# Effects that get a fit, and the share of the time that it takes to choose them.
KEPT, CHOICE = 3, 0.5


def is_part(effect: str, laws: Sequence[Law]) -> bool:
    """Whether an effect and a law share a subsystem: the law may be what the effect lacks.

    A mass over the position is no part of any effect.
    """
    own = effects()[effect].subsystem
    return any(
        table_subsystem(law.adds_to, law.of) == own for law in laws if law.adds_to != MASS[0]
    )


def effect_beside(
    case: Case,
    candidate: FittedCandidate,
    effect_ids: Sequence[str],
    least: float = 0.0,
    progress: Progress | None = None,
) -> FittedCandidate | None:
    """Fits a candidate with the effect that gains most beside its laws; None: none is worth it.

    An effect of the same subsystem as a law is not tried, because a curve can have any part of it;
    nor is a law that contains another, whose simpler one comes first.

    Parameters
    ----------
    case
        the records, with the integration steps of the decision.
    candidate
        with laws.
    effect_ids
        the effects that may be named.
    least
        of what is left, see `score.left`, an effect has to take this at least.
    progress
        called with the share of the work that is done.
    """
    laws = candidate.laws
    before = left(case, candidate)
    if before < EFFECT / EVIDENCE:  # not even an effect that leaves nothing is worth its cost
        return None
    start = linearised_start(case, candidate.effects, candidate.x, laws)
    sets = [
        (*candidate.effects, effect)
        for effect in effect_ids
        if effect not in candidate.effects
        and effects()[effect].contains is None
        and not is_part(effect, laws)
        and not repeats_a_law((*candidate.effects, effect))
    ]
    chosen = preselected(
        case, [(each, [start]) for each in sets], KEPT, part_of(progress, 0.0, CHOICE), laws
    )
    tasks = [partial(_fitted, case, each, start, laws) for each in chosen]
    fitted = [
        each
        for each in run_together(tasks, part_of(progress, CHOICE, 1.0))
        if matters(each.effects[-1], each.values, case.rig)
    ]
    if not fitted:
        return None
    # What is left and the prior cost of the effect, on one scale.
    costs = [left(case, each) + EFFECT / EVIDENCE * law_count(each.effects[-1:]) for each in fitted]
    best = int(np.argmin(costs))
    enough = costs[best] < before and before - left(case, fitted[best]) >= least
    return fitted[best] if enough else None


def without_law(case: Case, candidate: FittedCandidate, law: Law) -> FittedCandidate:
    """Fits a candidate with one of its laws less."""
    others = tuple(each for each in candidate.laws if each is not law)
    behind = itertools.dropwhile(lambda each: each is not law, candidate.laws)
    first = candidate.x.size - sum(each.knots.size for each in behind)
    x = np.delete(candidate.x, np.arange(first, first + law.knots.size))
    fitted = fit(case.problem(candidate.effects, laws=others), x, iterations=LONG)
    return evaluate(case, candidate.effects, fitted, others)


def constant_of(
    case: Case, without: FittedCandidate, law: Law, effect_ids: Sequence[str]
) -> FittedCandidate | None:
    """Fits a candidate with the effect that a law would be that is constant.

    A delay of the command that does not change with the time has a name. None: the law has no such
    effect among those that may be named.

    without: the candidate without the law.
    """
    effect = CONSTANTS.get(law.adds_to)
    effect_set = (*without.effects, effect or "")
    if effect is None or effect not in effect_ids or repeats_a_law(effect_set):
        return None
    start = linearised_start(case, without.effects, without.x, without.laws)
    found = _fitted(case, effect_set, start, without.laws)
    return found if matters(effect, found.values, case.rig) else None


def _fitted(
    case: Case, effect_set: tuple[str, ...], start: FitStart, laws: Sequence[Law]
) -> FittedCandidate:
    """The long fit of a set beside laws, from the best size of its last effect."""
    short = screen(case, effect_set, [start], laws)
    problem = case.problem(effect_set, laws=laws)
    return evaluate(case, effect_set, fit(problem, short.x, iterations=LONG), laws)
