# SPDX-License-Identifier: MIT
"""Fits the likely sets again, with what only the search shows and with all data.

- Of the speed of the spool, effects may have hidden a limit while the rig was calibrated.
- How much commands that nobody logged can do follows from the fit that leaves least, see
  `model.between_samples`. The fits until then follow errors that are tolerated from then on. A law,
  which is fitted later, would have an advantage over all that was fitted before.
- Held-out records excite values of the rig that the fitted ones do not show. What a set leaves
  there tells of these values, and not of the set, unless they are fitted to all records.
- Many records move a value as far as they like, whatever the rig file says. A second fit weighs its
  priors against the evidence of the decision, which does not grow with the records.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...base.numbers import FloatArray
from ...base.parallel import run_together
from ...catalogue.families import law_count
from ...records import Record
from ..deciding import EFFECT, EVIDENCE
from ..model.between_samples import LEAST_MOVE, fitted_move
from ..model.case import Case
from ..model.fit import Fit, fit
from ..model.unlogged import BETWEEN
from .candidates import (
    FittedCandidate,
    again_with_slower_spool,
    decision_case,
    evaluate,
    nominal_candidate,
    refine,
    refine_finely,
)
from .score import left, score_of, share_of_tolerance
from .search import USUAL_ROUNDS, SearchResult, restrict, usual_sizes, with_usual_sizes

# Sets this far behind the best one are no answer after another fit either, nats: what three
# effects cost.
BEHIND = 3.0 * EFFECT
# A set that leaves no more, ln, explains the records without commands that nobody logged.
EXPLAINED = 0.5
# Where the command moves in other records, it is held in one where that leaves so much less, ln. So
# it is in all of them, with the same effects, if the fitted move is nearer to 0, a held command,
# than to 1/2, two commands a sample.
CLEARLY, NEAR_HELD = 0.1, 0.25
# Steps of a fit to all data, which starts from that to a part of them, and of the next one, whose
# priors pull harder.
ITERATIONS_TOGETHER, ITERATIONS_HELD = 6, 10


@dataclass(frozen=True, eq=False)
class FittedToAll:
    """A set of effects that was fitted to all data; the costs and errors are those of the case."""

    freely: FittedCandidate
    """With values that the data move as far as they like."""
    held: FittedCandidate
    """With values that stay near the rig file, unless the evidence is worth more than their prior:
    those that make EVIDENCE left(x) + prior(x) least."""

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects of the set."""
        return self.freely.effects


def with_slower_spools(case: Case, found: SearchResult) -> SearchResult:
    """Returns the search with limits of the spool's speed where the likely sets show one."""
    return _again(case, found, partial(again_with_slower_spool, case))


def with_unlogged_commands(found: SearchResult) -> Case:
    """Returns the case with what unlogged commands can do, by the set that leaves least."""
    ahead = _ahead(found)
    return found.case.with_unlogged_commands(ahead.effects, ahead.x)


def contradicted(found: SearchResult) -> Case | None:
    """Returns the case to search anew, or None.

    Whether the command moves between the samples, the set that leaves least tells better than the
    values alone, by which the search began. Its fit tells the move. Where that is none, so does the
    likelihood: commands between the samples are unknown inputs if the errors are so much smaller
    then that it pays for the directions in which they count for less,

        left(whitened) + 1/2 ln det(I + Z Z') / N < left(held)

    Of several records, each is asked so by itself: a binary sequence may be held, and a sum of
    sines not. There the mean course tells the move, if it alone leaves less than a command that is
    held. In all of them it is held where that pays, see `_rather_held`.
    """
    case, ahead = found.case, _ahead(found)
    effects = ahead.effects
    share = share_of_tolerance(case, [found.calibrated, *found.refined])
    best = max((found.calibrated, *found.refined), key=lambda each: score_of(case, each, share))
    if case.unlogged:
        held = _rather_held(case, best)
        if held is not None:
            return held
        return _mixed(case, effects, ahead.x, refine_finely(case.as_logged(), effects, ahead.x).x)
    moving, fits = case.with_unlogged_commands(effects, ahead.x), [ahead.x]
    if moving is case and case.engine is None and left(case, ahead) > EXPLAINED:
        possible = case.with_unlogged_commands(effects, ahead.x, move=0.5)
        if possible.unlogged:
            again = refine(possible, effects, ahead.x)
            mixed = _mixed(possible, effects, ahead.x, again.x)
            if mixed is not None:
                return mixed
            if _with_widening(possible, again) < left(case, ahead):
                moving = possible.with_unlogged_commands(effects, again.x)
                fits.append(again.x)
    if not moving.unlogged:
        return None
    moving = _mixed(moving, effects, *fits) or moving
    return _rather_held(moving, refine_finely(moving, best.effects, best.x)) or moving


def _rather_held(moving: Case, best: FittedCandidate) -> Case | None:
    """The case whose command is held in all records, if that explains as much; else None.

    With the same effects, it is held where a fit that may choose the move ends without one, or near
    to that while a held command leaves clearly less. But an effect can make up for a command that
    wrongly moves: such a command is early by a quarter of a sample, and a delay of that length
    makes up for it. So a held command is tried with fewer effects as well, each of which counts as
    in the score:

        EVIDENCE left(held, fewer) + EFFECT fewer
            <= EVIDENCE (left(whitened, all) + 1/2 ln det(I + Z Z') / N) + EFFECT all

    moving: the case with commands that move. best: the most probable set in it.
    """
    as_logged, effects = moving.as_logged(), best.effects
    held = replace(as_logged, held={**as_logged.held, BETWEEN: 0.0})
    explained = _with_widening(moving, best)
    free = refine_finely(as_logged, effects, best.x)
    move = fitted_move(as_logged.parameters(effects), free.x)
    if move < LEAST_MOVE and left(as_logged, free) <= explained:
        return held
    rig_size, tasks = moving.problem().low.size, []
    for count in range(len(effects) + (move < NEAR_HELD)):
        for fewer in itertools.combinations(effects, count):
            x, filed = restrict(moving, best, fewer), held.problem(fewer).centre()
            filed[rig_size:] = x[rig_size:]
            tasks += [partial(refine_finely, held, fewer, start) for start in (x, filed)]

    def nats(leaves: float, named: tuple[str, ...]) -> float:
        return EVIDENCE * leaves + EFFECT * law_count(named)

    most = nats(explained, effects)
    for each in run_together(tasks):
        margin = CLEARLY if each.effects == effects else 0.0
        if nats(left(held, each) + margin, each.effects) <= most:
            return held
    return None


def _mixed(moving: Case, effects: tuple[str, ...], *fits: FloatArray) -> Case | None:
    """The case whose command is held in some records and moves in others; None if in all alike.

    It is None as well where this is what the given case has.

    moving: the case with commands that move. fits: x of fits of the effects; of each record the
    best one counts, once for a held and once for a moving command.
    """
    move, as_logged = moving.held[BETWEEN], moving.as_logged()

    def is_held(record: Record) -> bool:
        by_mean, by_single, without = (
            min(_left_in(case, record, effects, x, b) for x in fits)
            for case, b in ((as_logged, move), (moving, move), (as_logged, 0.0))
        )
        return without < min(by_mean, by_single) - CLEARLY

    held = [record for record in moving.records if is_held(record)]
    before = [record for record, each in moving.unlogged.items() if not each.moves]
    if len(held) in (0, len(moving.records)) or held == before:
        return None
    begun = moving.with_unlogged_commands(effects, fits[0], move, held)
    again = refine(begun, effects, fits[0])
    return begun.with_unlogged_commands(effects, again.x)


def _left_in(
    case: Case, record: Record, effects: tuple[str, ...], x: FloatArray, move: float
) -> float:
    """What a fit leaves in one record, with what the whitening takes from the likelihood.

    move: that of the command between the samples, whatever it is in the fit; 0: it is held.
    """
    whitening = case.unlogged.get(record)
    alone = replace(
        decision_case(case),
        training=(record,),
        held_out=(record,),
        blocks=False,
        unknown={},
        unlogged={} if whitening is None else {record: whitening},
    )
    x = np.where([each.name == BETWEEN for each in alone.parameters(effects)], move, x)
    nats, count = (0.0, 1) if whitening is None else whitening.widening
    return left(alone, evaluate(alone, effects, Fit(x, 0.0, 0, False)), "fitted") + nats / count


def _with_widening(case: Case, candidate: FittedCandidate) -> float:
    """What a candidate leaves, with what its whitening takes from the likelihood."""
    taken = [each.widening for each in case.unlogged.values()]
    widening = sum(nats for nats, _ in taken) / max(sum(count for _, count in taken), 1)
    return left(replace(case, unknown={}), candidate) + widening


def _ahead(found: SearchResult) -> FittedCandidate:
    return min((found.calibrated, *found.refined), key=lambda each: left(found.case, each))


def fitted_again(case: Case, found: SearchResult) -> SearchResult:
    """Returns the search with the calibrated rig and the likely sets fitted to a case.

    case: the case of the search, with what the records do not tell of the commands.
    """
    return _again(case, found, lambda each: refine_finely(case, each.effects, each.x))


def fitted_to_all(case: Case, found: SearchResult) -> tuple[FittedToAll, ...]:
    """Returns the calibrated rig and the likely sets with their values fitted to all data."""
    if case.engine is not None:  # a run of a user's simulator takes long
        return ()
    fine = decision_case(case)
    together = fine.together()

    def at(effects: tuple[str, ...], x: FloatArray) -> FittedCandidate:
        return evaluate(fine, effects, Fit(x, fine.problem(effects).cost(x), 0, False))

    def fitted(each: FittedCandidate) -> FittedToAll:
        problem, x = together.problem(each.effects), each.x
        for _ in range(1 + USUAL_ROUNDS):
            freely = at(each.effects, fit(problem, x, iterations=ITERATIONS_TOGETHER).x)
            usual, x = usual_sizes(together, freely)
            if usual is together:
                break
            problem = usual.problem(each.effects)
        # argmin EVIDENCE left(x) + prior(x)
        x = fit(problem.with_evidence(EVIDENCE), freely.x, iterations=ITERATIONS_HELD).x
        held = at(each.effects, x)
        # Where the first fit stopped early, as beside a limit cycle, the second one is better.
        return FittedToAll(min(freely, held, key=lambda one: left(fine, one)), held)

    return tuple(run_together([partial(fitted, each) for each in _likely(case, found)]))


def fitted_together(case: Case, joint: Case, found: SearchResult) -> SearchResult:
    """Returns the calibrated rig and the likely sets fitted to another division of the records.

    Of the other sets, it has the costs and errors there at the values that they have.

    case, found: the search. joint: the case of all records, of which blocks are held out.
    """
    likely = _likely(case, found)
    known = {id(each) for each in likely}
    others = [each for each in found.fitted() if id(each) not in known]
    fits = run_together([partial(refine_finely, joint, each.effects, each.x) for each in likely])
    calibrated, *refined = with_usual_sizes(joint, fits)
    refined.sort(key=lambda each: each.held_out_cost)

    def as_it_is(each: FittedCandidate) -> FittedCandidate:
        cost = joint.problem(each.effects).cost(each.x)
        return evaluate(joint, each.effects, Fit(each.x, cost, 0, False))

    screened = run_together([partial(as_it_is, each) for each in others])
    return SearchResult(
        joint, nominal_candidate(joint), calibrated, tuple(refined), tuple(screened)
    )


def _likely(case: Case, found: SearchResult) -> list[FittedCandidate]:
    share = share_of_tolerance(case, [found.calibrated, *found.refined])
    scores = [score_of(case, each, share) for each in found.refined]
    best = max([score_of(case, found.calibrated, share), *scores])
    return [found.calibrated] + [
        each for each, score in zip(found.refined, scores, strict=True) if score >= best - BEHIND
    ]


def _again(
    case: Case, found: SearchResult, another: Callable[[FittedCandidate], FittedCandidate]
) -> SearchResult:
    likely = _likely(case, found)
    fits = with_usual_sizes(case, run_together([partial(another, each) for each in likely]))
    again = dict(zip(map(id, likely), fits, strict=True))

    def newest(each: FittedCandidate) -> FittedCandidate:
        return again.get(id(each), each)

    refined = sorted(map(newest, found.refined), key=lambda each: each.held_out_cost)
    return replace(found, calibrated=newest(found.calibrated), refined=tuple(refined))
