# SPDX-License-Identifier: MIT
"""Search for effects: each one alone, then forward from the best few, then backward."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from ...base.numbers import FloatArray
from ...base.parallel import Progress, part_of, run_threads, run_together
from ...catalogue.families import repeats_a_law, spelled_out
from ...catalogue.parameters import acts_on, effects
from ...catalogue.spellings import sizes_of
from ...rigs import Rig
from ...rigs.carried import carried
from ..deciding import EFFECT, EVIDENCE
from ..model.case import Case
from ..model.fit import BEHIND_NATS
from ..model.parameters import effect_parameters
from ..model.scale import effect_starts
from ..model.separation import contains
from ..result import Stage
from .candidates import (
    FitStart,
    FittedCandidate,
    again_with_other_stiffness,
    again_with_slower_spool,
    calibrate,
    decision_case,
    grown_from,
    linearised_start,
    nominal_candidate,
    refine,
    refine_finely,
    screen,
)
from .identifiability import unmeasured_effects
from .intervals import largest_usual, matters, too_large
from .preselection import KEPT_ALONE, KEPT_TOGETHER, preselected
from .score import above_noise, left, score_of, share_of_tolerance

# The best few candidates of a screening get a long fit; the best of these are extended.
MOST_REFINED = 6
# A screening fit of four iterations shows half of the gain of a long fit, seldom less than a
# third. A candidate with a tenth of the gain of the first one does not overtake it.
LEAST_SCREENED_GAIN = 0.1
BEAM = 2
MOST_EFFECTS = 3
# Where a set leaves no more than this beyond the noise, no further effect is worth its prior cost.
NOTHING_LEFT = EFFECT / EVIDENCE

# Share of the time of a screening that the short fits from the start take; laws that grow from
# simpler ones take the rest. Of the former, what it takes to choose which are worth a fit.
SCREENING = 0.75
PRESELECTION = 0.2


class Look(Protocol):
    """Called when a stage begins."""

    def __call__(
        self,
        stage: Stage,
        nominal: FittedCandidate,
        calibrated: FittedCandidate,
        fitted: Sequence[FittedCandidate],
        /,
        *,
        tasks: int = 0,
    ) -> None:
        """Takes the rig as configured, with its values fitted, and sets, that ahead first.

        tasks: how much there is to do, as of `pace.Known`.
        """


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Result of the search: all candidates that were fitted."""

    case: Case
    """The case to which they were fitted: with unknown commands between the samples, perhaps."""
    nominal: FittedCandidate
    calibrated: FittedCandidate
    """The rig as configured, and with its values fitted."""
    refined: tuple[FittedCandidate, ...]
    """Sets of effects that got the long fit, lowest held-out cost first."""
    screened: tuple[FittedCandidate, ...]
    """Short fits of each effect alone; with `refit.fitted_together`, what was not fitted again."""

    def fitted(self) -> list[FittedCandidate]:
        """Each set once, with its longest fit, lowest held-out cost first."""
        refined_sets = {frozenset(candidate.effects) for candidate in self.refined}
        only_screened = [
            candidate
            for candidate in self.screened
            if frozenset(candidate.effects) not in refined_sets
        ]
        return sorted((self.calibrated, *self.refined, *only_screened), key=_held_out_cost)


def candidate_effects(
    rig: Rig, exclude: Sequence[str] = (), outputs: Collection[str] | None = None
) -> tuple[str, ...]:
    """Ids of the effects that are tried: the plant can have them, the rig file does not.

    outputs: names of the compared outputs; effects that need others are left out. None: all.
    """
    reasons = {} if rig.simulator is None else carried(rig)
    tried = tuple(
        info.id
        for info in effects().values()
        if acts_on(info, rig.plant)
        and reasons.get(info.id) is None
        and info.id not in (*rig.effects(), *exclude)
        # The record itself shows an effect without start values, such as quantisation.
        and effect_starts(info.id, rig)
    )
    unmeasured = () if outputs is None else [each.id for each in unmeasured_effects(outputs, tried)]
    return tuple(effect for effect in tried if effect not in unmeasured)


def search(
    case: Case,
    exclude: Sequence[str] = (),
    progress: Progress | None = None,
    look: Look | None = None,
) -> SearchResult:
    """Fits all sets of effects that may explain the records; it decides only where to look.

    Where the fit without effects shows that the command moves between the samples, unlogged
    commands are unknown inputs of all fits, see `model.between_samples`.

    progress: called with the share of the present stage that is done; `look` begins a stage.
    """
    look = _no_look if look is None else look
    nominal = nominal_candidate(case)
    look("values", nominal, nominal, [nominal])
    calibrated = calibrate(case)
    moving = case.with_unlogged_commands((), calibrated.x)
    if moving.unlogged and not case.unlogged:
        # The first fit followed what unlogged commands do.
        case = moving.with_unlogged_commands((), refine(moving, (), calibrated.x).x)
        nominal, calibrated = nominal_candidate(case), calibrate(case)
    look("alone", nominal, calibrated, [calibrated])
    effect_ids = candidate_effects(case.rig, exclude, case.outputs)
    screened = _screen_extensions(case, [calibrated], effect_ids, progress, extra_x=[nominal.x])
    promising = _promising(case, screened, left(case, calibrated))
    singles = _by_held_out_cost(calibrated, *screened)
    look("at length", nominal, calibrated, singles, tasks=len(promising))
    single_effects = _refine_all(case, promising, part_of(progress, 0.0, 0.5))
    stiffer = [partial(again_with_other_stiffness, case, each) for each in single_effects]
    single_effects = sorted(run_together(stiffer), key=partial(left, case))
    limited = [partial(again_with_slower_spool, case, each) for each in single_effects[:BEAM]]
    single_effects[:BEAM] = run_together(limited)
    # The calibration alone gets the same chance: it starts again from the values of the rig that
    # the fits with the best effects have reached.
    rig_size = calibrated.x.size
    restarts = [candidate.x[:rig_size] for candidate in single_effects[:2]]
    restarted = run_together(
        [partial(refine, case, (), x) for x in restarts], part_of(progress, 0.5, 0.65)
    )
    calibrated = min([calibrated, *restarted], key=lambda candidate: candidate.cost)
    simpler = run_together(
        _simpler_law_tasks(case, effect_ids, single_effects, single_effects),
        part_of(progress, 0.65, 0.8),
    )
    single_effects = _grown_again(case, single_effects, [*single_effects, *simpler])
    refined = [*single_effects, *simpler]
    front = single_effects
    for count in range(2, (1 if case.effort == "list" else MOST_EFFECTS) + 1):
        contained = [calibrated, *refined]
        share = share_of_tolerance(case, contained)
        if min(above_noise(case, each, share) for each in contained) < NOTHING_LEFT:
            break
        scores = {frozenset(each.effects): score_of(case, each, share) for each in contained}
        parents = [each for each in front if _is_ahead_of_all_inside(each, scores)][:BEAM]
        if not parents:
            break
        ahead = _by_held_out_cost(*contained, *screened)
        look("together", nominal, calibrated, ahead, tasks=len(parents))
        extended = _screen_extensions(case, parents, effect_ids, part_of(progress, 0.0, 0.75))
        promising = _promising(case, extended, min(left(case, each) for each in front))
        grown = _refine_all(case, promising, part_of(progress, 0.75, 0.85))
        reduced = run_together(
            [
                *_backward_tasks(case, grown[:1], refined),
                *_simpler_law_tasks(case, effect_ids, grown, [*grown, *refined]),
            ],
            part_of(progress, 0.85, 0.95),
        )
        grown = _grown_again(case, grown, [*grown, *refined, *reduced])
        refined += [*grown, *reduced]
        smaller = max(
            score_of(case, candidate, share)
            for candidate in [calibrated, *refined]
            if len(candidate.effects) < count
        )
        front = [each for each in grown if score_of(case, each, share) > smaller]
        if not front:
            break
    refined += run_together(_spelled_out_tasks(case, effect_ids, refined, refined))
    calibrated, *refined = never_behind(case, without_small_effects(case, [calibrated, *refined]))
    refined = with_usual_sizes(case, refined)
    look("deciding", nominal, calibrated, _by_held_out_cost(calibrated, *refined, *screened))
    return SearchResult(
        case, nominal, calibrated, tuple(sorted(refined, key=_held_out_cost)), tuple(screened)
    )


def _no_look(*known: object, tasks: int = 0) -> None:
    """Nobody asked to be told."""


def _held_out_cost(candidate: FittedCandidate) -> float:
    return candidate.held_out_cost


def _by_held_out_cost(*candidates: FittedCandidate) -> list[FittedCandidate]:
    return sorted(candidates, key=_held_out_cost)


def _is_ahead_of_all_inside(
    candidate: FittedCandidate, scores: Mapping[frozenset[str], float]
) -> bool:
    """Whether a set has a better score than each fitted set that it contains.

    Else the laws that contain Coulomb friction would be the parents of the same sets as that.
    """
    own = frozenset(candidate.effects)
    return scores[own] > max(
        score
        for effects, score in scores.items()
        if effects != own and contains(candidate.effects, tuple(effects))
    )


def _screen_extensions(
    case: Case,
    parents: Sequence[FittedCandidate],
    effect_ids: Sequence[str],
    progress: Progress | None,
    extra_x: Sequence[FloatArray] = (),
) -> list[FittedCandidate]:
    """Makes short fits of every parent with every effect that it does not have, each set once.

    A law that contains another starts from the short fit of that one: in 150 such fits its own
    starts ended lower by more than 20 nats not once, and higher by 100 to 900 in twelve.

    extra_x: x of further starts without effects, shape (n,) each.
    """
    extra_starts = [linearised_start(case, (), x) for x in extra_x]
    tasks: dict[tuple[str, ...], Callable[[], FittedCandidate]] = {}
    simpler_laws: dict[tuple[str, ...], tuple[str, ...]] = {}
    covered: dict[frozenset[str], tuple[str, ...]] = {}
    starts_of: dict[tuple[str, ...], Sequence[FitStart]] = {}
    for parent in parents:
        fit_starts = [linearised_start(case, parent.effects, parent.x), *extra_starts]
        for effect in effect_ids:
            effect_set = (*parent.effects, effect)
            if effect in parent.effects or frozenset(effect_set) in covered:
                continue
            if repeats_a_law(effect_set):
                continue
            covered[frozenset(effect_set)] = effect_set
            starts_of[effect_set] = fit_starts
            simpler = effects()[effect].contains
            start_set = effect_set
            if simpler is not None and simpler not in effect_set:
                start_set = simpler_laws[effect_set] = (*parent.effects, simpler)
            tasks.setdefault(start_set, partial(screen, case, start_set, fit_starts))
    if case.effort != "full":
        kept = KEPT_TOGETHER if parents[0].effects else KEPT_ALONE[case.effort]
        known = [(each, starts_of[each]) for each in tasks if each in starts_of]
        keep = set(preselected(case, known, kept, part_of(progress, 0.0, PRESELECTION)))
        keep |= tasks.keys() - starts_of.keys()  # simpler laws that are left out by themselves
        tasks = {each: task for each, task in tasks.items() if each in keep}
        simpler_laws = {law: start for law, start in simpler_laws.items() if start in keep}
        # The same set in another order is the simpler law of another one.
        covered = {key: each for key, each in covered.items() if each in {*tasks, *simpler_laws}}
    shorts = run_together(list(tasks.values()), part_of(progress, PRESELECTION, SCREENING))
    found = dict(zip(tasks, shorts, strict=True))
    grown = run_together(
        [
            partial(grown_from, case, found[simpler_set], effect_set)
            for effect_set, simpler_set in simpler_laws.items()
        ],
        part_of(progress, SCREENING, 1.0),
    )
    found |= {candidate.effects: candidate for candidate in grown}
    return sorted((found[effect_set] for effect_set in covered.values()), key=partial(left, case))


def _promising(
    case: Case, screened: Sequence[FittedCandidate], before: float
) -> Sequence[FittedCandidate]:
    """Returns the first few, except those that gain little beside the first one.

    before: what is left without the last effect.
    """
    gains = [before - left(case, each) for each in screened[:MOST_REFINED]]
    least_gain = LEAST_SCREENED_GAIN * max(gains[0], 0.0) if gains else 0.0
    return [
        each for each, gain in zip(screened, gains, strict=False) if gain >= least_gain
    ] or screened[:1]


def _refine_all(
    case: Case, promising: Sequence[FittedCandidate], progress: Progress | None
) -> list[FittedCandidate]:
    """Makes long fits of promising sets, and longer ones of the two best."""
    tasks = [partial(refine, case, candidate.effects, candidate.x) for candidate in promising]
    of_errors = partial(left, case)
    refined = sorted(run_together(tasks, part_of(progress, 0.0, 0.8)), key=of_errors)
    # The order of the two best must not depend on where their fits were stopped.
    tasks = [
        partial(refine, case, candidate.effects, candidate.x)
        for candidate in refined[:2]
        if not candidate.converged
    ]
    repeated = run_together(tasks, part_of(progress, 0.8, 1.0))
    repeated_sets = {candidate.effects for candidate in repeated}
    return sorted(
        [
            *repeated,
            *(candidate for candidate in refined if candidate.effects not in repeated_sets),
        ],
        key=of_errors,
    )


def _backward_tasks(
    case: Case, candidates: Sequence[FittedCandidate], fitted: Sequence[FittedCandidate]
) -> list[partial[FittedCandidate]]:
    """Returns tasks that fit the best sets with one effect less, unless that was fitted already."""
    fitted_sets = {frozenset(candidate.effects) for candidate in fitted}
    tasks = []
    for candidate in candidates:
        for dropped in candidate.effects:
            remaining = tuple(effect for effect in candidate.effects if effect != dropped)
            if frozenset(remaining) not in fitted_sets:
                tasks.append(partial(refine, case, remaining, restrict(case, candidate, remaining)))
    return tasks


def _simpler_law_tasks(
    case: Case,
    effect_ids: Sequence[str],
    candidates: Sequence[FittedCandidate],
    fitted: Sequence[FittedCandidate],
) -> list[partial[FittedCandidate]]:
    """Returns tasks that fit the best sets with a simpler law, unless that was fitted already."""
    fitted_sets = {frozenset(candidate.effects) for candidate in fitted}
    tasks = []
    for candidate in candidates:
        for effect in candidate.effects:
            simpler = effects()[effect].contains
            others = tuple(other for other in candidate.effects if other != effect)
            if simpler is None or simpler not in effect_ids or simpler in others:
                continue
            if frozenset((*others, simpler)) in fitted_sets:
                continue
            start = effects()[effect].simplified(sizes_of(effect, candidate.values))
            sizes = [x for _, x in effect_parameters(simpler, start, case.rig.plant)]
            x = np.concatenate([restrict(case, candidate, others), sizes])
            tasks.append(partial(refine, case, (*others, simpler), x))
    return tasks


def _spelled_out_tasks(
    case: Case,
    effect_ids: Sequence[str],
    candidates: Sequence[FittedCandidate],
    fitted: Sequence[FittedCandidate],
) -> list[partial[FittedCandidate]]:
    """Returns tasks that fit the two effects as which an effect acts, unless that was done."""
    by_set = {frozenset(candidate.effects): candidate for candidate in fitted}
    tasks = []
    for candidate in candidates:
        for effect in candidate.effects:
            two = spelled_out((effect,))
            if len(two) < 2 or not set(two) <= set(effect_ids):
                continue
            others = set(candidate.effects) - {effect}
            simpler = by_set.get(frozenset({*others, two[0]}))
            if simpler is not None and frozenset({*others, *two}) not in by_set:
                tasks.append(partial(_with_one_more, case, simpler, two[1]))
    return tasks


def _with_one_more(case: Case, candidate: FittedCandidate, effect: str) -> FittedCandidate:
    """Makes the long fit of a set with one more effect."""
    start = linearised_start(case, candidate.effects, candidate.x)
    short = screen(case, (*candidate.effects, effect), [start])
    return refine(case, short.effects, short.x)


def _grown_again(
    case: Case, candidates: Sequence[FittedCandidate], fitted: Sequence[FittedCandidate]
) -> list[FittedCandidate]:
    """Fits sets again from their simpler laws where a short fit from there ends ahead.

    The cost has several minima in the values of a law that contains another, and the long fit of
    the simpler law is nearer to the lowest one than the short fit from which the set came. The
    result has all candidates, in their order.
    """
    by_set = {frozenset(candidate.effects): candidate for candidate in fitted}
    tasks = []
    for candidate in candidates:
        for effect in candidate.effects:
            contained = effects()[effect].contains
            if contained is None:
                continue
            simpler = by_set.get(frozenset(candidate.effects) - {effect} | {contained})
            if simpler is not None:
                tasks.append(partial(grown_from, case, simpler, candidate.effects))
    best = {frozenset(candidate.effects): candidate for candidate in candidates}
    ahead = [
        short
        for short in run_together(tasks)
        if short.cost < best[frozenset(short.effects)].cost - BEHIND_NATS
    ]
    for longer in run_together([partial(refine, case, each.effects, each.x) for each in ahead]):
        effect_set = frozenset(longer.effects)
        best[effect_set] = min(best[effect_set], longer, key=lambda each: each.cost)
    return list(best.values())


def never_behind(case: Case, candidates: Sequence[FittedCandidate]) -> list[FittedCandidate]:
    """Fits again each set that ended behind a set that it contains; returns all sets.

    A set that contains another can always fit as well: its further effects can be off, or its law
    can be the simpler one. Where it does not, its fit ended in another minimum, and it starts again
    from the contained set. Small sets and simple laws come first, so that those that contain them
    profit.
    """
    by_set = {frozenset(candidate.effects): candidate for candidate in candidates}
    for level in sorted({_level(candidate) for candidate in candidates}):
        tasks = []
        for candidate in [each for each in by_set.values() if _level(each) == level]:
            ahead = min(
                (each for each in by_set.values() if _is_contained(each, candidate)),
                key=lambda each: each.cost,
                default=None,
            )
            if ahead is not None and ahead.cost < candidate.cost - BEHIND_NATS:
                tasks.append(partial(_from_contained, case, ahead, candidate.effects))
        for fitted in run_together(tasks):
            effect_set = frozenset(fitted.effects)
            by_set[effect_set] = min(by_set[effect_set], fitted, key=lambda each: each.cost)
    return list(by_set.values())


def _level(candidate: FittedCandidate) -> tuple[int, int]:
    """Number of effects, and how many of their laws contain another; lower in contained sets."""
    containing = sum(effects()[effect].contains is not None for effect in candidate.effects)
    return len(candidate.effects), containing


def _is_contained(smaller: FittedCandidate, larger: FittedCandidate) -> bool:
    """Whether the larger set has the effects of the smaller one, or laws that contain them."""
    return set(smaller.effects) != set(larger.effects) and contains(larger.effects, smaller.effects)


def _from_contained(
    case: Case, contained: FittedCandidate, effect_set: tuple[str, ...]
) -> FittedCandidate:
    """Fits a set from the values of a contained one, with its further effects off."""
    x = contained.x[: contained.x.size - _effects_size(case, contained.effects)]
    fine = decision_case(case)
    for count, effect in enumerate(effect_set, start=1):
        problem = fine.problem(effect_set[:count])
        trials = [np.concatenate([x, sizes]) for sizes in _sizes_as_in(case, contained, effect)]
        costs = run_threads([partial(problem.cost, trial) for trial in trials])
        x = trials[int(np.argmin(costs))]
    return refine_finely(case, effect_set, x)


def _sizes_as_in(case: Case, contained: FittedCandidate, effect: str) -> list[FloatArray]:
    """Sizes at which an effect acts as in a contained set, of which the cost tells the best."""
    own = effect_parameters(effect, effect_starts(effect, case.rig)[0], case.rig.plant)
    if effect in contained.effects:
        return [restrict(case, contained, (effect,))[-len(own) :]]
    simpler = effects()[effect].contains
    if simpler is not None and simpler in contained.effects:
        same = effects()[effect].same(sizes_of(simpler, contained.values))
        return [np.array([x for _, x in effect_parameters(effect, same, case.rig.plant)])]
    # An effect is off at zero, at an end of the range of a logarithm, or where a gain is one.
    ends = [
        (each.place(info.neutral),)
        if info.neutral
        else (each.low, each.high)
        if each.logarithmic
        else (0.0,)
        for (each, _), info in zip(own, effects()[effect].parameters, strict=True)
    ]
    return [np.array(corner) for corner in itertools.product(*ends)]


def _effects_size(case: Case, effect_ids: Sequence[str]) -> int:
    """Number of parameters of these effects."""
    return sum(_parameter_count(case, effect) for effect in effect_ids)


def without_small_effects(
    case: Case, candidates: Sequence[FittedCandidate]
) -> list[FittedCandidate]:
    """Fits again each set that ended behind a larger one whose further effects do not matter.

    Such effects can explain little, so that the smaller set can fit nearly as well. Where it does
    not, its fit ended in another minimum, and it starts again from the larger set. The calibration
    comes first, as in `candidates`.
    """
    by_set = {frozenset(candidate.effects): candidate for candidate in candidates}
    ahead: dict[frozenset[str], FittedCandidate] = {}
    for candidate in candidates:
        large = frozenset(
            effect for effect in candidate.effects if matters(effect, candidate.values, case.rig)
        )
        smaller = by_set.get(large)
        if len(large) == len(candidate.effects) or smaller is None:
            continue
        best = ahead.get(large, smaller)
        if candidate.cost < best.cost - (BEHIND_NATS if best is smaller else 0.0):
            ahead[large] = candidate
    tasks = []
    for large_set, candidate in ahead.items():
        kept = tuple(effect for effect in candidate.effects if effect in large_set)
        tasks.append(partial(refine, case, kept, restrict(case, candidate, kept)))
    for fitted in run_together(tasks):
        effect_set = frozenset(fitted.effects)
        by_set[effect_set] = min(by_set[effect_set], fitted, key=lambda each: each.cost)
    return list(by_set.values())


# A law that is held to a usual size moves its other sizes. So often it is held anew.
USUAL_ROUNDS = 4


def with_usual_sizes(case: Case, candidates: Sequence[FittedCandidate]) -> list[FittedCandidate]:
    """Fits sets again in which a law has more of its own than any servo has, with less of it."""
    found = list(candidates)
    for _ in range(USUAL_ROUNDS):
        usual = {place: usual_sizes(case, each) for place, each in enumerate(found)}
        tasks = {
            place: partial(refine, held, found[place].effects, x)
            for place, (held, x) in usual.items()
            if held is not case
        }
        for place, again in zip(tasks, run_together(list(tasks.values())), strict=True):
            found[place] = again
    return found


def usual_sizes(case: Case, candidate: FittedCandidate) -> tuple[Case, FloatArray]:
    """Returns the case that holds laws to the sizes that servos have, and the x to start from.

    Where a motion does not show how a law ends, such as friction at rest where the rod never rests
    for long, a fit may end at sizes that no servo has, although usual ones explain nearly as much.
    It is the same case where no law of the candidate is so large.
    """
    held: dict[str, float] = {}
    for effect in candidate.effects:
        if too_large(effect, candidate.values, case.rig):
            held |= largest_usual(effect, candidate.values, case.rig)
    if not held:
        return case, candidate.x
    usual = replace(case, held={**case.held, **held})
    x = candidate.x.copy()
    for index, parameter in enumerate(usual.parameters(candidate.effects)):
        x[index] = parameter.place(held.get(parameter.name, parameter.value(x[index])))
    return usual, x


def restrict(case: Case, candidate: FittedCandidate, remaining: Sequence[str]) -> FloatArray:
    """Returns the x of a candidate with the parameters of the remaining effects only."""
    of_laws = sum(law.knots.size for law in candidate.laws)
    begin = candidate.x.size - of_laws - _effects_size(case, candidate.effects)
    parts = [candidate.x[:begin]]
    for effect in candidate.effects:
        count = _parameter_count(case, effect)
        if effect in remaining:
            parts.append(candidate.x[begin : begin + count])
        begin += count
    return np.concatenate([*parts, candidate.x[begin:]])


def _parameter_count(case: Case, effect: str) -> int:
    start = effect_starts(effect, case.rig)[0]
    return len(effect_parameters(effect, start, case.rig.plant))
