# SPDX-License-Identifier: MIT
"""Fits again with the tolerance of commands that nobody logged, which only the search shows.

How much these commands can do follows from the fit that leaves least, see `model.between_samples`.
The fits until then follow errors that are tolerated from then on. A law, which is fitted later,
would have an advantage over all that was fitted before.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ...base.parallel import run_together
from ..deciding import EFFECT
from ..model.case import Case
from .candidates import FittedCandidate, refine_finely
from .score import score_of
from .search import SearchResult

# Sets this far behind the best one are no answer after another fit either, nats: what three
# effects cost.
BEHIND = 3.0 * EFFECT


def fitted_again(case: Case, found: SearchResult) -> SearchResult:
    """Returns the search with the calibrated rig and the likely sets fitted to a case.

    case: the case of the search, with what the records do not tell of the commands.
    """
    scores = [score_of(case, each) for each in found.refined]
    best = max([score_of(case, found.calibrated), *scores])
    chosen = [found.calibrated] + [
        each for each, score in zip(found.refined, scores, strict=True) if score >= best - BEHIND
    ]
    tasks = [partial(refine_finely, case, each.effects, each.x) for each in chosen]
    again = dict(zip(map(id, chosen), run_together(tasks), strict=True))

    def newest(each: FittedCandidate) -> FittedCandidate:
        return again.get(id(each), each)

    refined = sorted(map(newest, found.refined), key=lambda each: each.held_out_cost)
    return replace(found, calibrated=newest(found.calibrated), refined=tuple(refined))
