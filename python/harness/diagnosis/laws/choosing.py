# SPDX-License-Identifier: MIT
"""Choice of the laws that are shown: those without which the best set leaves clearly more."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from ...base.numbers import FloatArray
from ...base.parallel import Progress, part_of
from ...catalogue.families import law_count
from ...catalogue.spellings import ParameterKey
from ..deciding import EFFECT, EVIDENCE
from ..model.case import Case
from ..model.fit import fit
from ..model.parameters import Law
from ..schema import MissingLaw
from ..search.candidates import FittedCandidate, decision_case, evaluate
from ..search.gap_reduction import WindowSums, mean_gap
from ..search.intervals import LEVEL, candidate_covariance, matters
from ..search.score import left, price_of_values
from ..search.search import restrict
from .beside import constant_of, effect_beside, is_part, without_law
from .drifting import Drift, explains_more
from .fitting import LONG, with_law, with_one_law
from .forms import MASS, MASSES, MENU, SPRING, describe, is_linkage, visited
from .forms import laws as laws_of_menu

MOST_LAWS = 2
# Prior cost of a law, nats: that of two effects, for its form is free, and of the choice among the
# menu.
LAW = 2.0 * EFFECT + math.log(sum(len(variables) for variables in MENU.values()))
# That it is the cause costs as much again: tables follow a part of whatever is left.
CAUSE = 2.0 * EFFECT
# A mass over the position is that of a linkage where it changes by this factor, without this share
# of the samples at either end. Set between 1.22, which 25 of 26 linkages have or more, and 1.10,
# the largest of three machines without one; one linkage has 1.12 (docs/gap/missing_laws.md).
LEAST_LEVER, SELDOM = 1.15, 0.05
# A second law, or an effect, must matter beside the first: both follow whatever that one leaves.
LEAST_OF_FIRST = 0.3
# And it must remove this share of the gap: a law that removes nothing is not told.
LEAST_OF_GAP = 0.01
# Effects of the catalogue that are a force over the position and nothing else.
SPRINGS = ("load_spring", "contact_spring")
# Other laws count as rivals where what they leave is no more than this above the best.
RIVAL = EFFECT / EVIDENCE
# The ends of a band lie further out than the fit says by this share of the rms of the law: then it
# held the true curve over 80 % of what was visited for 15 of 16 effects of known size that were
# left out of the catalogue (docs/gap/missing_laws.md).
BAND_FURTHER = 0.085


@dataclass(frozen=True, eq=False)
class LawsFound:
    """The calibrated rig, perhaps with effects, with the laws that it lacks."""

    candidate: FittedCandidate
    """The fit with these effects and laws."""
    laws: tuple[MissingLaw, ...]
    forms: tuple[tuple[float, ...] | None, ...]
    """The laws for the reader, and of each its simple form as in `result.Diagnosis.law_forms`."""
    of_effects: float
    """Share of the effects in the shrinkage of the held-out gap, 0 to 1; the laws have the rest."""
    hypotheses: tuple[tuple[tuple[str, ...], float], ...]
    """Effects beside laws, first those of the candidate, each with the evidence for it against the
    rig without laws and effects, whose values cost nothing, nats."""
    held: Mapping[str, float]
    """Sizes of effects that were held, by full name: the laws are what remains beside them."""


def missing_laws(
    case: Case,
    calibrated: FittedCandidate,
    best: FittedCandidate,
    progress: Progress | None = None,
    effect_ids: Sequence[str] = (),
    drift: Drift | None = None,
) -> LawsFound | None:
    """Looks for laws that explain what the best set leaves; None where there is none.

    Laws are added to the best set and to the rig without effects: the effects of the best set may
    be there only because the law was missing. After each law, effects that show only beside it.

    Parameters
    ----------
    case
        the records.
    calibrated, best
        the rig without effects, and with the best set of effects.
    progress
        called with the share of the work that is done.
    effect_ids
        the effects that may be named beside the laws.
    drift
        values that change in the course of the records, beside the best set. Laws over the time
        are tried only where one of them explains more.
    """
    over_time = drift is None or not explains_more(case, best, drift)
    fine = decision_case(case)
    starts = [calibrated, best] if best.effects else [calibrated]
    parts = len(starts) + 1
    chains = [
        _Chain(fine, (start,), (), tuple(effect_ids), over_time=over_time).longer(
            part_of(progress, place / parts, (place + 1) / parts)
        )
        for place, start in enumerate(starts)
    ]
    costs = [each.penalised for each in chains]
    chain = chains[costs.index(min(costs))]
    last = part_of(progress, (parts - 1) / parts, 1.0)
    if not chain.last.laws:
        return None
    chain = chain.with_effect(part_of(last, 0.0, 0.25))
    longer = chain.longer(part_of(last, 0.25, 0.5))
    if longer is not chain:
        chain = longer.with_one_law_less()
        if chain is not longer:
            chain = chain.longer(part_of(last, 0.5, 0.75))
        chain = chain.with_effect(part_of(last, 0.75, 1.0))
    origin = chain.steps[0]
    chain = _springs_taken_in(fine, chain)
    candidate = _without_needless(fine, chain.last)
    held = {
        name: value
        for name, value in best.values.items()
        if ParameterKey(name).effect in candidate.effects
        and is_part(str(ParameterKey(name).effect), candidate.laws)
    }
    if held:
        fine = replace(fine, held={**fine.held, **held})
        candidate = _with_held_sizes(fine, candidate)
    # Effects that were left out again have no share of what was removed.
    start = chain.steps[0] if candidate.effects else calibrated
    steps = [calibrated, start, *chain.steps[1:-1], candidate]
    shares = _shares([each.sums for each in steps])
    if shares is None:
        return None
    by_law = [
        share
        for share, (before, after) in zip(shares, itertools.pairwise(steps), strict=True)
        if len(after.laws) > len(before.laws)
    ]
    if not candidate.effects:  # what an effect had removed that is needless now
        by_law = [share / (sum(by_law) or 1.0) for share in by_law]
    here = visited(fine, candidate)
    mass_kg = sum(candidate.values.get(name, 0.0) for name in MASSES)
    tables = candidate.tables()
    laws, forms = [], []
    for law, deviations, share, others in zip(
        candidate.laws, _deviations(fine, candidate), by_law, chain.rivals, strict=True
    ):
        weights = _nearest(law, here[law.of])
        table = tables[law.name]
        told = describe(table, weights, mass_kg)
        band = _band(np.array(table.values), deviations, np.array(weights))
        laws.append(
            MissingLaw(
                adds_to=table.adds_to,
                of=table.of,
                knots=table.knots,
                values=table.values,
                band=band,
                share_of_shrinkage=share,
                looks_like=told.words,
                visited=weights,
                rivals=others,
            )
        )
        forms.append(told.form)
    evidence = _evidence(fine, calibrated, candidate)
    # Laws beside the effects of another chain are as much behind as that chain was, and without an
    # effect that was found beside them by what it gained.
    hypotheses = [(candidate.effects, evidence)]
    hypotheses += [
        (start.effects, evidence - EVIDENCE * (cost - min(costs)))
        for start, cost in zip(starts, costs, strict=True)
        if start is not origin and set(start.effects) != set(candidate.effects)
    ]
    hypotheses += [
        (tuple(each for each in candidate.effects if each != effect), evidence - gain)
        for effect, gain in chain.beside
        if effect in candidate.effects
    ]
    of_effects = 1.0 - sum(by_law)
    return LawsFound(candidate, tuple(laws), tuple(forms), of_effects, tuple(hypotheses), held)


def shows_linkage(case: Case, candidate: FittedCandidate) -> bool:
    """Whether a mass over the position gains more than it costs beside a candidate."""
    fine = decision_case(case)
    mass = [law for law in laws_of_menu(fine, candidate) if (law.adds_to, law.of) == MASS]
    before = left(fine, candidate)
    # Where little is left, not even a mass that leaves nothing is worth its cost.
    if not mass or before < len(mass) * EFFECT / EVIDENCE:
        return False
    found = with_law(fine, candidate, mass[0])
    return before - left(fine, found) >= _price(fine, found) and _shrinks(candidate, found)


def moves_as_lever(case: Case, candidate: FittedCandidate) -> bool:
    """Whether the laws of a candidate are those of a linkage, whose mass changes by LEAST_LEVER."""
    if not is_linkage(candidate.laws):
        return False
    mass_kg = sum(candidate.values.get(name, 0.0) for name in MASSES)
    (law,) = (each for each in candidate.laws if (each.adds_to, each.of) == MASS)
    # Where the rod seldom is, a curve follows whatever is left there.
    low_m, high_m = np.quantile(visited(case, candidate)[law.of], [SELDOM, 1.0 - SELDOM])
    table, places = candidate.tables()[law.name], np.linspace(low_m, high_m, law.knots.size)
    moved_kg = mass_kg + np.interp(places, table.knots, table.values)
    return float(moved_kg.max()) >= LEAST_LEVER * float(moved_kg.min())


def _shrinks(before: FittedCandidate, found: FittedCandidate) -> bool:
    return mean_gap(found.sums) <= (1.0 - LEAST_OF_GAP) * mean_gap(before.sums)


@dataclass(frozen=True, eq=False)
class _Chain:
    """A start and its fits with one law more each, or one effect."""

    case: Case
    steps: tuple[FittedCandidate, ...]
    rivals: tuple[tuple[tuple[str, str], ...], ...]
    """Of each law, others that explain as much."""
    effect_ids: tuple[str, ...] = ()
    """Effects that may be named beside the laws."""
    beside: tuple[tuple[str, float], ...] = ()
    """Effects that were found beside the laws, and what each gains, nats, its prior cost taken."""
    over_time: bool = True

    @property
    def last(self) -> FittedCandidate:
        return self.steps[-1]

    @property
    def penalised(self) -> float:
        """What the last fit leaves, and the prior cost of its effects and laws on that scale."""
        return _penalised(self.case, self.last)

    def longer(self, progress: Progress | None) -> _Chain:
        """With a law more, or the same where none is worth its cost."""
        found = with_one_law(self.case, self.last, progress, over_time=self.over_time)
        if not found:
            return self
        lefts = [left(self.case, each) for each in self.steps]
        first = lefts[0] - lefts[-1]
        for each in sorted(found, key=lambda each: each.left + _price(self.case, each.candidate)):
            price = _price(self.case, each.candidate) - _price(self.case, self.last)
            least = (
                price
                if moves_as_lever(self.case, each.candidate)
                else max(price, LEAST_OF_FIRST * first)
            )
            if lefts[-1] - each.left >= least:
                break
        else:
            return self
        if not _shrinks(self.last, each.candidate):
            return self
        rivals = tuple(
            (other.law.adds_to, other.law.of)
            for other in found
            if other is not each and abs(other.left - each.left) < RIVAL
        )
        return replace(self, steps=(*self.steps, each.candidate), rivals=(*self.rivals, rivals))

    def with_effect(self, progress: Progress | None) -> _Chain:
        """With an effect more, or the same where none is worth its cost."""
        lefts = [left(self.case, each) for each in self.steps]
        least = LEAST_OF_FIRST * (lefts[0] - lefts[-1])
        found = effect_beside(self.case, self.last, self.effect_ids, least, progress)
        if found is None:
            return self
        gain = self.penalised - _penalised(self.case, found)
        beside = (*self.beside, (found.effects[-1], EVIDENCE * gain))
        return replace(self, steps=(*self.steps, found), beside=beside)

    def with_one_law_less(self) -> _Chain:
        """Without the law that the other one makes needless, or with an effect in its place.

        The first law may stand in for the second: the delay of the command seems to drift where the
        simulator lacks a mass. Beside that it is off, or it is constant, and that is an effect. The
        same where neither leaves as little for its cost.
        """
        best, shorter = self.penalised, self
        for place, law in enumerate(self.last.laws if len(self.last.laws) > 1 else ()):
            without = without_law(self.case, self.last, law)
            named = constant_of(self.case, without, law, self.effect_ids)
            for found in filter(None, (without, named)):
                is_free = found is named and is_part(found.effects[-1], found.laws)
                cost = _penalised(self.case, found) + is_free * EFFECT / EVIDENCE
                if cost > best:
                    continue
                gain = EVIDENCE * (self.penalised - cost)
                best, shorter = (
                    cost,
                    replace(
                        self,
                        steps=(self.steps[0], _without_laws(self.case, found), found),
                        rivals=self.rivals[:place] + self.rivals[place + 1 :],
                        beside=self.beside
                        if found is without
                        else (*self.beside, (found.effects[-1], gain)),
                    ),
                )
        return shorter


def _springs_taken_in(case: Case, chain: _Chain) -> _Chain:
    """Replaces springs that are named beside a law over the position by a force over it.

    Such a law can have any spring in it, so that the spring says nothing of its own: a workpiece is
    not a spring and a law that corrects it. And a mass over the position is that of a linkage,
    which has a force over the position, too; a spring or a constant force is only what this
    resembles. The replacement is taken where it leaves hardly more.
    """
    last = chain.last
    over_position = [law.adds_to for law in last.laws if (law.adds_to, law.of) in (SPRING, MASS)]
    loads = (*SPRINGS, "load_force") if "mass" in over_position else SPRINGS
    remaining = tuple(each for each in last.effects if each not in loads)
    if len(remaining) == len(last.effects) or not over_position:
        return chain
    without = _fitted(case, restrict(case, last, remaining), remaining, last.laws)
    start = _without_laws(case, without)
    steps, rivals = (start, *chain.steps[1:-1], without), chain.rivals
    if "force" not in over_position:
        if len(last.laws) == MOST_LAWS:
            return chain
        force = next(law for law in laws_of_menu(case, without) if (law.adds_to, law.of) == SPRING)
        steps, rivals = (*steps, with_law(case, without, force)), (*rivals, ())
    if left(case, steps[-1]) > left(case, last) + RIVAL:
        return chain
    return replace(chain, steps=steps, rivals=rivals)


def _fitted(
    case: Case, x: FloatArray, effects: tuple[str, ...], laws: tuple[Law, ...]
) -> FittedCandidate:
    return evaluate(case, effects, fit(case.problem(effects, laws=laws), x, iterations=LONG), laws)


def _without_laws(case: Case, candidate: FittedCandidate) -> FittedCandidate:
    """Fits the effects of a candidate alone."""
    of_laws = sum(law.knots.size for law in candidate.laws)
    return _fitted(case, candidate.x[: candidate.x.size - of_laws], candidate.effects, ())


def _penalised(case: Case, candidate: FittedCandidate) -> float:
    laws = law_count([each for each in candidate.effects if not is_part(each, candidate.laws)])
    return left(case, candidate) + laws * EFFECT / EVIDENCE + _price(case, candidate)


def _evidence(case: Case, calibrated: FittedCandidate, candidate: FittedCandidate) -> float:
    """Evidence that the laws of a candidate are the cause, nats; see `_price`.

    Its values have their price, against those of the calibrated rig at none.
    """
    gain = EVIDENCE * (_penalised(case, calibrated) - _penalised(case, candidate))
    gain -= price_of_values(case, candidate, candidate).total
    return gain - (0.0 if moves_as_lever(case, candidate) else CAUSE)


def _price(case: Case, candidate: FittedCandidate) -> float:
    """Prior cost of the laws of a candidate on the scale of what is left.

    Those of a linkage cost as much as an effect each, because a mass over the position that changes
    as that of a lever follows no other cause: beside the best sets of 23 such machines it gained
    0.6 nats at most.
    """
    return len(candidate.laws) * (EFFECT if moves_as_lever(case, candidate) else LAW) / EVIDENCE


def _without_needless(case: Case, candidate: FittedCandidate) -> FittedCandidate:
    """Leaves out effects that are not worth their prior cost beside the laws.

    An effect of the same subsystem as a law stays, unless it became too small to be named: friction
    that differs by direction is Coulomb friction and a law besides.
    """
    for effect in candidate.effects:
        part = is_part(effect, candidate.laws)
        if part and matters(effect, candidate.values, case.rig):
            continue
        remaining = tuple(each for each in candidate.effects if each != effect)
        start = restrict(case, candidate, remaining)
        smaller = _fitted(case, start, remaining, candidate.laws)
        # `_penalised` leaves out the cost of a part.
        cost = EFFECT / EVIDENCE if part else 0.0
        if _penalised(case, smaller) <= _penalised(case, candidate) + cost:
            return _without_needless(case, smaller)
    return candidate


def _with_held_sizes(case: Case, candidate: FittedCandidate) -> FittedCandidate:
    """Fits the laws anew beside effects of the same subsystem, whose sizes are held.

    Otherwise neither would have a meaning of its own: a curve can have any part of the effect.
    """
    problem = case.problem(candidate.effects, laws=candidate.laws)
    fitted = fit(problem, candidate.x, iterations=2 * LONG)
    return evaluate(case, candidate.effects, fitted, candidate.laws)


def _shares(steps: Sequence[WindowSums]) -> list[float] | None:
    """Share of each step in the shrinkage of the held-out gap; None where it does not shrink."""
    gaps = [mean_gap(sums) for sums in steps]
    removed = [max(before - after, 0.0) for before, after in itertools.pairwise(gaps)]
    if gaps[-1] >= gaps[0]:
        return None
    return [each / sum(removed) for each in removed]


def _deviations(case: Case, candidate: FittedCandidate) -> list[FloatArray]:
    """Standard deviation of the values of each law at its knots, by the covariance of the fit."""
    of_all, _ = candidate_covariance(case, candidate)
    found, first = [], candidate.x.size - sum(law.knots.size for law in candidate.laws)
    for law in candidate.laws:
        own = slice(first, first + law.knots.size)
        first = own.stop
        # values = L z, so that their covariance is L C L'
        variance = np.diag(law.basis @ of_all[own, own] @ law.basis.T)
        found.append(np.asarray(np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64))
    return found


def _band(
    values: FloatArray, deviations: FloatArray, weights: FloatArray
) -> tuple[tuple[float, float], ...]:
    """Interval of the value at each knot; weights: share of the samples there."""
    rms = float(np.sqrt(np.sum(weights * values**2)))
    half = float(norm.ppf(0.5 + 0.5 * LEVEL)) * deviations + BAND_FURTHER * rms
    return tuple(zip((values - half).tolist(), (values + half).tolist(), strict=True))


def _nearest(law: Law, samples: FloatArray) -> tuple[float, ...]:
    """Share of the samples that are nearer to each knot than to any other."""
    middles = 0.5 * (law.knots[1:] + law.knots[:-1])
    counts = np.bincount(np.searchsorted(middles, samples), minlength=law.knots.size)
    return tuple((counts / max(samples.size, 1)).tolist())
