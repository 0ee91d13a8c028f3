# SPDX-License-Identifier: MIT
"""Search for effects: each one alone, then forward from the best few, then backward."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.keys import sizes_of
from ehsid.harness.catalogue.parameters import acts_on, effects
from ehsid.harness.gap.inference.advantage import above_floor, advantage
from ehsid.harness.gap.inference.rivals import Rival, as_told, base, calibrate, polish, screen
from ehsid.harness.gap.inference.sizes import matters
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.machine import effect_starts
from ehsid.harness.gap.model.parameters import effect_parameters
from ehsid.harness.gap.thresholds import (
    AT_FLOOR,
    BEAM,
    FORWARD_NATS,
    FORWARD_RELATIVE,
    IN_THE_RUNNING,
    KEPT,
    MOST_EFFECTS,
)
from ehsid.harness.parallel import Progress, run_tasks
from ehsid.harness.rigs import Rig


@dataclass(frozen=True, eq=False)
class Found:
    """Result of the search: all candidates that were fitted.

    Attributes
    ----------
    nominal, calibrated
        the rig as configured, and with its values fitted.
    rivals
        sets of effects that got the long fit, lowest held-out cost first.
    screened
        short fits of each effect alone.
    """

    nominal: Rival
    calibrated: Rival
    rivals: tuple[Rival, ...]
    screened: tuple[Rival, ...]


def candidates(rig: Rig, exclude: Sequence[str] = ()) -> tuple[str, ...]:
    """Ids of the effects that may be found: the plant can have them, the rig file does not."""
    return tuple(
        info.id
        for info in effects().values()
        if acts_on(info, rig.plant)
        and info.id not in (*rig.effects(), *exclude)
        # The record itself shows an effect without start values, such as quantisation.
        and effect_starts(info.id, rig)
    )


def search(case: Case, exclude: Sequence[str] = (), progress: Progress | None = None) -> Found:
    """Fits all sets of effects that may explain the records; it decides only where to look."""
    told = _Steps(progress)
    nominal = as_told(case)
    calibrated = calibrate(case)
    told.done(0.1)
    asked = candidates(case.rig, exclude)
    singles = _widen(case, [calibrated], asked, told.part(0.35), more=[nominal.x])
    alone = _lengthen(case, singles, _both(calibrated), told.part(0.5))
    # The calibration alone gets the same chance: it starts again from the values of the rig that
    # the fits with the best effects found.
    size = calibrated.x.size
    again = [one.x[:size] for one in alone[:2]]
    calibrated = min([calibrated, *(polish(case, (), x) for x in again)], key=lambda one: one.cost)
    rivals = [*alone, *run_tasks(_simpler(case, asked, alone[:1], alone))]
    level = alone
    for count in range(2, MOST_EFFECTS + 1):
        if above_floor(case, min([calibrated, *rivals], key=_held_out)) < AT_FLOOR:
            break
        parents = [one for one in level if _pays(case, one, calibrated)][:BEAM]
        if not parents:
            break
        wider = _widen(case, parents, asked, told.part(0.5 + 0.2 * count - 0.25))
        before = min(_both(one) for one in level)
        grown = _lengthen(case, wider, before, told.part(0.5 + 0.2 * count - 0.2))
        shrunk = run_tasks(
            [
                *_without_one(case, grown[:1], rivals),
                *_simpler(case, asked, grown[:1], [*grown, *rivals]),
            ]
        )
        rivals += [*grown, *shrunk]
        less = min((one for one in rivals if len(one.effects) < count), key=_held_out)
        level = [one for one in grown if _pays(case, one, less)]
        if not level:
            break
    told.done(1.0)
    return Found(nominal, calibrated, tuple(sorted(rivals, key=_held_out)), tuple(singles))


def _held_out(rival: Rival) -> float:
    return rival.held_out_cost


def _both(rival: Rival) -> float:
    """Sum of both costs, nats, so that an effect that only one part excites is not lost."""
    return rival.cost + rival.held_out_cost


def _pays(case: Case, more: Rival, less: Rival) -> bool:
    """Tells whether to search further from `more`; the verdict requires a larger gain."""
    if not all(matters(effect, more.values, case.rig) for effect in more.effects):
        return False
    gain = advantage(case, more, less)
    return gain.nats > FORWARD_NATS and gain.relative > FORWARD_RELATIVE


def _widen(
    case: Case,
    parents: Sequence[Rival],
    asked: Sequence[str],
    progress: Progress,
    more: Sequence[FloatArray] = (),
) -> list[Rival]:
    """Makes short fits of every parent with every effect that it does not have, each set once.

    more: values of further bases without effects.
    """
    tasks, seen = [], set()
    others = [base(case, (), x) for x in more]
    for parent in parents:
        bases = [base(case, parent.effects, parent.x), *others]
        for effect in asked:
            wider = frozenset((*parent.effects, effect))
            if effect in parent.effects or wider in seen:
                continue
            seen.add(wider)
            tasks.append(partial(screen, case, (*parent.effects, effect), bases))
    return sorted(run_tasks(tasks, progress), key=_both)


def _lengthen(case: Case, short: Sequence[Rival], before: float, progress: Progress) -> list[Rival]:
    """Makes long fits of the first few, except of those that gain little beside the first one.

    before: cost without the last effect, as `_both` defines it, nats.
    """
    least = IN_THE_RUNNING * max(before - _both(short[0]), 0.0) if short else 0.0
    running = [one for one in short[:KEPT] if before - _both(one) >= least] or short[:1]
    tasks = [partial(polish, case, one.effects, one.x) for one in running]
    long = sorted(run_tasks(tasks, progress), key=_both)
    # The order of the two best must not depend on where their fits were stopped.
    tasks = [partial(polish, case, one.effects, one.x) for one in long[:2] if not one.converged]
    again = run_tasks(tasks)
    done = {one.effects for one in again}
    return sorted([*again, *(one for one in long if one.effects not in done)], key=_both)


def _without_one(case: Case, best: Sequence[Rival], there: Sequence[Rival]) -> list[partial[Rival]]:
    """Returns tasks that fit the best sets with one effect less, unless that was fitted already."""
    known = {frozenset(one.effects) for one in there}
    tasks = []
    for rival in best:
        for left_out in rival.effects:
            kept = tuple(effect for effect in rival.effects if effect != left_out)
            if frozenset(kept) not in known:
                tasks.append(partial(polish, case, kept, restrict(case, rival, kept)))
    return tasks


def _simpler(
    case: Case, asked: Sequence[str], best: Sequence[Rival], there: Sequence[Rival]
) -> list[partial[Rival]]:
    """Returns tasks that fit the best sets with a simpler law, unless that was fitted already."""
    known = {frozenset(one.effects) for one in there}
    tasks = []
    for rival in best:
        for effect in rival.effects:
            simpler = effects()[effect].contains
            others = tuple(one for one in rival.effects if one != effect)
            if simpler is None or simpler not in asked or simpler in others:
                continue
            if frozenset((*others, simpler)) in known:
                continue
            start = effects()[effect].simplified(sizes_of(effect, rival.values))
            sizes = [x for _, x in effect_parameters(simpler, start, case.rig.plant)]
            x = np.concatenate([restrict(case, rival, others), sizes])
            tasks.append(partial(polish, case, (*others, simpler), x))
    return tasks


def restrict(case: Case, rival: Rival, kept: Sequence[str]) -> FloatArray:
    """Returns the x of a candidate without the parameters of effects that are not kept."""
    place = rival.x.size - sum(_width(case, effect) for effect in rival.effects)
    parts = [rival.x[:place]]
    for effect in rival.effects:
        width = _width(case, effect)
        if effect in kept:
            parts.append(rival.x[place : place + width])
        place += width
    return np.concatenate(parts)


def _width(case: Case, effect: str) -> int:
    start = effect_starts(effect, case.rig)[0]
    return len(effect_parameters(effect, start, case.rig.plant))


class _Steps:
    """Progress of successive stages, each up to a share of the whole search, 0 to 1."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._share = 0.0

    def done(self, share: float) -> None:
        self._share = max(self._share, min(share, 1.0))
        if self._progress is not None:
            self._progress(self._share)

    def part(self, end: float) -> Progress:
        begin = self._share
        return lambda share: self.done(begin + share * (end - begin))
