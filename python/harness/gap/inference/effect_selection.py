# SPDX-License-Identifier: MIT
"""Selection of the set of effects that the data require, and of the equivalent sets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.intervals import candidate_deviations
from ehsid.harness.gap.inference.likelihood_gain import LikelihoodGain, above_floor, likelihood_gain
from ehsid.harness.gap.inference.search import SearchResult
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
    MOST_ABOVE_FLOOR,
)

FORCE = "load_force"
FRICTION = frozenset(("coulomb_friction", "stribeck_friction"))


@dataclass(frozen=True, eq=False)
class Selection:
    """Selected set of effects, and the sets that the data cannot separate from it.

    Attributes
    ----------
    best
        the calibrated rig with the fewest effects that the data require.
    equivalent
        other sets that the data cannot separate from `best`, lowest held-out cost first; each of
        them is better than the calibrated rig alone.
    """

    best: FittedCandidate
    equivalent: tuple[FittedCandidate, ...]


def edges_can_replace_force(case: Case, candidate: FittedCandidate) -> bool:
    """Whether unequal edges of the valve can explain the load force of a candidate.

    They can where no pressure is measured and the force is small beside its standard deviation.
    """
    if case.pressures or FORCE not in candidate.effects or case.rig.plant != "ehs":
        return False
    names = [parameter.name for parameter in case.parameters(candidate.effects)]
    index = names.index(ParameterKey.of_effect(FORCE, "force_n"))
    deviations, _ = candidate_deviations(case, candidate)
    return abs(float(candidate.x[index])) < FORCE_DEVIATIONS * float(deviations[index])


def insignificance(gain: LikelihoodGain) -> str | None:
    """Returns why a likelihood gain cannot decide between two sets; None where it can."""
    if gain.nats < DECIDED_NATS:
        return (
            f"the held-out log-likelihood differs by {gain.nats:.1f} nats, and {DECIDED_NATS:g} "
            "are needed to decide"
        )
    if gain.low <= 0.0:
        return "in more than one of twenty draws of the windows the difference has the other sign"
    if gain.relative < DECIDED_RELATIVE:
        return (
            f"the errors differ by {100.0 * math.expm1(gain.relative):.1f} % only, and no "
            f"simulator is exact to {100.0 * DECIDED_RELATIVE:.0f} % of its errors"
        )
    return None


def is_significant(gain: LikelihoodGain) -> bool:
    """Whether a likelihood gain is significant, and large enough to matter."""
    return insignificance(gain) is None


def objection(
    case: Case, larger: FittedCandidate, smaller: FittedCandidate, calibrated: FittedCandidate
) -> str | None:
    """Returns why the gain of `larger` over `smaller` does not justify its further effects.

    None where it does.
    """
    gain = likelihood_gain(case, larger, smaller)
    why = insignificance(gain)
    if why is not None:
        return why
    needed = DECIDED_SHARE * min(above_floor(case, smaller), MOST_ABOVE_FLOOR)
    if gain.relative < needed:
        return (
            f"it makes the errors {100.0 * -math.expm1(-gain.relative):.1f} % smaller; with so "
            f"much left above the noise floor, {100.0 * -math.expm1(-needed):.1f} % are needed"
        )
    scale = case.variation()
    # Each output is divided by its variation. Divided by its own error, an output whose simulated
    # sensor has no noise, and whose error is rounding, would outweigh all others.
    before, after, all_errors = (
        held_out_rms(candidate) / scale for candidate in (smaller, larger, calibrated)
    )
    removed = before - after
    # An effect of one sensor shows in one output. Summed over all outputs, its share would be small
    # beside the errors that another effect causes in the others.
    if not np.any((removed >= DECIDED_OF_ALL * all_errors) & (removed >= DECIDED_OF_MOTION)):
        return (
            f"it removes less than {100.0 * DECIDED_OF_ALL:.0f} % of the errors of the calibrated "
            "rig in every output"
        )
    if float(np.sum(removed)) < DECIDED_OF_MOTION * scale.size:
        return (
            f"it removes less than {100.0 * DECIDED_OF_MOTION:.2g} % of the variation of the "
            "measured signals"
        )
    return None


def is_justified(
    case: Case, larger: FittedCandidate, smaller: FittedCandidate, calibrated: FittedCandidate
) -> bool:
    """Whether the gain of `larger` over `smaller` justifies its further effects."""
    return objection(case, larger, smaller, calibrated) is None


def removed_share(case: Case, best: FittedCandidate, calibrated: FittedCandidate) -> float:
    """Share of the calibrated errors above the noise floor that the effects of `best` remove."""
    floors = np.array([case.floors[name].value for name in case.outputs])
    before, after = (
        np.maximum(held_out_rms(candidate) - floors, 0.0) for candidate in (calibrated, best)
    )
    scale = case.variation()
    return 1.0 - float(np.sum(after / scale) / max(np.sum(before / scale), 1e-300))


def held_out_rms(candidate: FittedCandidate) -> FloatArray:
    """Rms of the held-out errors by output, in the unit of the output, shape (outputs,)."""
    return np.asarray(
        np.sqrt(candidate.squares.sum(axis=0) / candidate.counts.sum()), dtype=np.float64
    )


def select_effects(case: Case, search_result: SearchResult) -> Selection:
    """Chooses the set of effects that the data require: none, one, a pair and so on.

    The best set of each size replaces a smaller one only where the data require it.
    """
    pool = [
        candidate
        for candidate in search_result.refined
        if all(matters(effect, candidate.values, case.rig) for effect in candidate.effects)
        and not edges_can_replace_force(case, candidate)
    ]
    best = search_result.calibrated
    for count in sorted({len(candidate.effects) for candidate in pool}):
        larger = min(
            (candidate for candidate in pool if len(candidate.effects) == count),
            key=lambda candidate: candidate.held_out_cost,
        )
        if is_justified(case, larger, best, search_result.calibrated):
            best = larger
    best = _simplest_equivalent(case, best, pool, search_result.calibrated)
    if not best.effects or removed_share(case, best, search_result.calibrated) < DECIDED_TOGETHER:
        return Selection(search_result.calibrated, ())
    equivalent = [
        candidate
        for candidate in pool
        if candidate is not best
        and len(candidate.effects) <= len(best.effects)
        and not is_significant(likelihood_gain(case, best, candidate))
        and is_justified(case, candidate, search_result.calibrated, search_result.calibrated)
        and not contains(candidate.effects, best.effects)
    ]
    return Selection(best, tuple(sorted(equivalent, key=lambda candidate: candidate.held_out_cost)))


def _simplest_equivalent(
    case: Case, best: FittedCandidate, pool: Sequence[FittedCandidate], calibrated: FittedCandidate
) -> FittedCandidate:
    """Returns the simplest nested set that does as well as `best`, else `best` itself.

    Examples are Coulomb friction for Stribeck friction, or one effect for two.
    """
    for candidate in sorted(
        pool,
        key=lambda candidate: (len(candidate.effects), candidate.x.size, candidate.held_out_cost),
    ):
        simpler = (len(candidate.effects), candidate.x.size) < (len(best.effects), best.x.size)
        nested = simpler and contains(best.effects, candidate.effects)
        if nested and not is_justified(case, best, candidate, calibrated):
            return candidate
    return best


def effect_families(effects: Sequence[str]) -> frozenset[str]:
    """Returns the set of effects with both laws of friction counted as one."""
    return frozenset("friction" if effect in FRICTION else effect for effect in effects)
