# SPDX-License-Identifier: MIT
"""Choice of the set of effects that the data require, and of the sets that do as well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.gap.inference.advantage import Advantage, above_floor, advantage
from ehsid.harness.gap.inference.intervals import scatter_of
from ehsid.harness.gap.inference.rivals import Rival
from ehsid.harness.gap.inference.search import Found
from ehsid.harness.gap.inference.sizes import matters
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.separation import contains
from ehsid.harness.gap.thresholds import (
    DECIDED_NATS,
    DECIDED_OF_ALL,
    DECIDED_OF_MOTION,
    DECIDED_RELATIVE,
    DECIDED_SHARE,
    DECIDED_TOGETHER,
    FORCE_DEVIATIONS,
    NEAREST,
)

FORCE = "load_force"
FRICTION = frozenset(("coulomb_friction", "stribeck_friction"))


@dataclass(frozen=True, eq=False)
class Choice:
    """Chosen set of effects, and the sets that the data cannot tell from it.

    Attributes
    ----------
    best
        the calibrated rig with the fewest effects that the data require.
    equals
        other sets that the data cannot tell from `best`, lowest held-out cost first; each of them
        is better than the calibrated rig alone.
    """

    best: Rival
    equals: tuple[Rival, ...]


def _edges_do_as_well(case: Case, rival: Rival) -> bool:
    """Tells whether unequal edges of the valve could stand for a candidate's load force.

    They can where no pressure is measured and the force is small beside its standard deviation.
    """
    if case.pressures or FORCE not in rival.effects or case.rig.plant != "ehs":
        return False
    names = [one.name for one in case.parameters(rival.effects)]
    place = names.index(ParameterKey.of_effect(FORCE, "force_n"))
    scatter, _ = scatter_of(case, rival)
    return abs(float(rival.x[place])) < FORCE_DEVIATIONS * float(scatter[place])


def decided(gain: Advantage) -> bool:
    """Tells whether an advantage is beyond doubt, and large enough to count."""
    return gain.nats >= DECIDED_NATS and gain.low > 0.0 and gain.relative >= DECIDED_RELATIVE


def asked_for(case: Case, more: Rival, less: Rival, calibrated: Rival) -> bool:
    """Tells whether `more` is so much better than `less` that its effects are justified."""
    gain = advantage(case, more, less)
    left = min(above_floor(case, less), NEAREST)
    smaller = rms(less) - rms(more)
    return (
        decided(gain)
        and gain.relative >= DECIDED_SHARE * left
        and float(np.mean(smaller / np.maximum(rms(calibrated), 1e-300))) >= DECIDED_OF_ALL
        and float(np.mean(smaller / case.variation())) >= DECIDED_OF_MOTION
    )


def together(case: Case, best: Rival, calibrated: Rival) -> float:
    """Share of the calibrated errors above the noise floor that the effects of `best` remove."""
    floors = np.array([case.floors[name].value for name in case.outputs])
    before, after = (np.maximum(rms(one) - floors, 0.0) for one in (calibrated, best))
    scale = case.variation()
    return 1.0 - float(np.sum(after / scale) / max(np.sum(before / scale), 1e-300))


def rms(rival: Rival) -> FloatArray:
    """Rms of the held-out errors by output, in the unit of the output, shape (outputs,)."""
    return np.asarray(np.sqrt(rival.squares.sum(axis=0) / rival.counts.sum()), dtype=np.float64)


def choose(case: Case, found: Found) -> Choice:
    """Chooses the set of effects that the data require: none, one, a pair and so on.

    The best set of each size replaces a smaller one only where the data require it.
    """
    pool = [
        one
        for one in found.rivals
        if all(matters(effect, one.values, case.rig) for effect in one.effects)
        and not _edges_do_as_well(case, one)
    ]
    best = found.calibrated
    for count in sorted({len(one.effects) for one in pool}):
        wider = min(
            (one for one in pool if len(one.effects) == count), key=lambda one: one.held_out_cost
        )
        if asked_for(case, wider, best, found.calibrated):
            best = wider
    best = _simplest(case, best, pool, found.calibrated)
    if not best.effects or together(case, best, found.calibrated) < DECIDED_TOGETHER:
        return Choice(found.calibrated, ())
    equals = [
        one
        for one in pool
        if one is not best
        and len(one.effects) <= len(best.effects)
        and not decided(advantage(case, best, one))
        and asked_for(case, one, found.calibrated, found.calibrated)
        and not contains(one.effects, best.effects)
    ]
    return Choice(best, tuple(sorted(equals, key=lambda one: one.held_out_cost)))


def _simplest(case: Case, best: Rival, pool: Sequence[Rival], calibrated: Rival) -> Rival:
    """Returns the simplest nested set that does as well as `best`, else `best` itself.

    Examples are Coulomb friction for Stribeck friction, or one effect for two.
    """
    for one in sorted(pool, key=lambda one: (len(one.effects), one.x.size, one.held_out_cost)):
        simpler = (len(one.effects), one.x.size) < (len(best.effects), best.x.size)
        nested = simpler and contains(best.effects, one.effects)
        if nested and not asked_for(case, best, one, calibrated):
            return one
    return best


def one_family(effects: Sequence[str]) -> frozenset[str]:
    """Returns the set of effects with both laws of friction counted as one."""
    return frozenset("friction" if effect in FRICTION else effect for effect in effects)
