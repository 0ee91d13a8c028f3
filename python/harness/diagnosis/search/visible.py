# SPDX-License-Identifier: MIT
"""How small an effect could still be seen in records.

The simulator runs with the effect, at the values that explain the records without it. Then the
values are fitted to these outputs without the effect, as the search would do: they absorb what they
can. What they leave has the power D_b in band b. Besides, the errors of the records stay, with the
power P_b. With the numbers n_b and the tolerated powers t_b of `model.spectrum`, the score of the
decision rises by

    gain = EVIDENCE sum_b (n_b / 2) ln(1 + D_b / (P_b + t_b)) / sum_b n_b

if the effect is named. It is seen where the gain, less what chance takes of it in one case of ten,
is at least what naming it costs: EFFECT for each law, SMALL while it is hardly larger than its
least size, and the ln of FALSE_ALARM / MISSED, from which on a name loses less than none. Its
distance from nothing must also be that of a test with a false alarm in a hundred and a power of
90 %, which counts in records of a few seconds only.

Neither the effect nor what absorbs it is linear. Each size is simulated, and the next one to try is
that which would suffice if D grew as the square of the size. Where a size is far from the answer,
the sensitivities tell what is absorbed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.stats import norm

from ...base.numbers import FloatArray
from ...base.parallel import run_together, single_threaded_algebra
from ...catalogue.families import law_count, repeats_a_law
from ...catalogue.parameters import effects as catalogue
from ...catalogue.spellings import effect_values
from ...records import Record
from ...rigs import Rig
from ..data.gate import usable_part
from ..deciding import EFFECT, EVIDENCE, FALSE_ALARM, MISSED, SMALL
from ..model.case import Case, make_case
from ..model.fit import descent
from ..model.linear import Linear
from ..model.parameters import Law, effect_parameters
from ..model.problem import Problem
from ..model.scale import effect_starts, machine_scale
from ..model.separation import quadratic, reweighted
from ..schema import CouldBeSeen
from .candidates import FittedCandidate
from .intervals import margin, scaled
from .search import candidate_effects

# Power and false alarm, as deviations of a normal distribution.
OF_POWER, OF_ALARM = float(norm.isf(0.1)), float(norm.isf(0.01))
# Steps of the fit at most; the share of the cost that is little for one, and that by which it may
# be above the promise; and how near to the answer a size is worth a fit, ln.
FIT_STEPS, LITTLE, AS_PROMISED, WORTH_A_FIT = 12, 0.05, 0.15, 0.7
# So many steps that gain little end a fit.
ENOUGH = 2
# Sizes that are simulated at most, and how near the last two are, ln.
MOST_RUNS, NEAR = 12, 0.15
# Share of a bracket that the next size keeps from either end: the simulator may jump there.
INNER = 0.2
# Range of the factor of a size, ln; what is larger or smaller is no servo.
WIDEST = 14.0


@dataclass(frozen=True, eq=False)
class Ground:
    """Records, and the simulator without the effect that is looked for."""

    case: Case
    """All data are fitted: nothing is held out."""
    effects: tuple[str, ...]
    laws: tuple[Law, ...]
    """What the simulator has besides its values."""
    problem: Problem
    x: FloatArray
    """Values of these parameters, shape (n,)."""
    linear: Linear
    """Coefficients and sensitivities there."""
    left: FloatArray
    """Power of the errors that stay without the effect, shape (outputs, BANDS)."""


def ground_of(case: Case, candidate: FittedCandidate | None = None) -> Ground:
    """Returns the records with a fitted candidate, or with the rig as the rig file tells it.

    As told, the simulator is taken to leave the noise only: before a fit nobody knows more.
    """
    whole = replace(case, training=case.records, blocks=False)
    if candidate is None:
        problem = whole.problem()
        x = problem.centre()
        likelihoods = problem.likelihoods.values()
        left = np.stack([one.narrowed(0.0).tolerated for one in likelihoods])
        return Ground(whole, (), (), problem, x, problem.linear(x), left)
    problem = whole.problem(candidate.effects, laws=candidate.laws)
    sizes = sum(case.problem(held_out=part).spectrum.sizes for part in (False, True))
    left = candidate.fit_powers.sum(axis=0) + candidate.powers.sum(axis=0)
    return Ground(
        whole,
        candidate.effects,
        candidate.laws,
        problem,
        candidate.x,
        problem.linear(candidate.x),
        left / np.maximum(sizes, 1.0),
    )


def before_any_fit(record: Record, rig: Rig) -> tuple[CouldBeSeen, ...]:
    """Returns what a record could show at best, if the simulator is as good as is tolerated.

    The values are those of the rig file, and may absorb what their uncertainty allows. There is no
    entry where the record cannot carry a diagnosis, and none for a user's simulator.

    Parameters
    ----------
    record
        with `command_v` and `position_m`; its longest stretch with the supply up counts.
    rig
        any plant of ehsid.
    """
    if rig.simulator is not None:
        return ()
    try:
        case = make_case(rig, [usable_part(record, rig)[0]])
    except ValueError:  # too short, or nothing moves: the caller has said so
        return ()
    with single_threaded_algebra():
        return could_be_seen(ground_of(case), candidate_effects(rig, outputs=case.outputs))


def could_be_seen(ground: Ground, effect_ids: Sequence[str]) -> tuple[CouldBeSeen, ...]:
    """Returns for each effect the smallest size with which the records would have shown it.

    effect_ids: in the order of the result; those that repeat a law of the ground, and those that
    the record shows without a fit, such as quantisation, are left out.
    """
    asked = [
        effect
        for effect in effect_ids
        if effect_starts(effect, ground.case.rig)
        and effect not in ground.effects
        and not repeats_a_law((*ground.effects, effect))
    ]
    for name in ground.problem.outputs:
        ground.linear.gram(name)  # once, not in each task
    return tuple(run_together([partial(smallest, ground, effect) for effect in asked]))


def smallest(ground: Ground, effect: str) -> CouldBeSeen:
    """Returns the smallest size of an effect with which the records would have shown it.

    The sizes keep the proportions of the first ones at which a fit starts; those on which the
    outputs do not depend in proportion, such as a frequency, stay as they are there.
    """
    start = effect_starts(effect, ground.case.rig)[0]
    least, most = _range(ground.case, effect, start)

    def needed(factor: float, powers: FloatArray) -> float:
        """The ln of the factor by which the size must grow, or may shrink."""
        return _needed(
            lambda by: _excess(ground, effect, scaled(effect, start, factor + by), powers, by)
        )

    # Ends of the bracket: factors of the size, and what each of them needs.
    below, above = (-math.inf, math.inf), (math.inf, -math.inf)
    factor, fitted, fits, last = least, None, 0.0, 0.0
    for _ in range(MOST_RUNS):
        problem, linear = shown(ground, effect, scaled(effect, start, factor))
        if linear is None:  # the simulation diverges: it is not like the machine
            by = -math.inf
        else:
            powers, promised = linear_refit(problem, linear, ground.x)
            by = needed(factor, powers)
            if abs(by) < WORTH_A_FIT or fitted is not None:
                # What absorbed the effect at another size does so here, in proportion.
                at = ground.x if fitted is None else ground.x + math.exp(factor - fits) * fitted
                powers, x = _refit(problem, linear, ground.x, at, promised)
                by = needed(factor, powers)
                if fitted is None:
                    above = math.inf, -math.inf  # what the sensitivities alone said counts no more
                fitted, fits = x - ground.x, factor
        # Illinois method: where one end moves twice, what the other one needs is halved. A curve
        # that is bent would else never let that end move.
        if by > 0.0:
            above, below = (above[0], above[1] * (0.5 if last > 0.0 else 1.0)), (factor, by)
        else:
            below, above = (below[0], below[1] * (0.5 if last < 0.0 else 1.0)), (factor, by)
        last = by
        width = above[0] - below[0]
        if above[0] <= least or below[0] >= most or abs(by) < NEAR or width < NEAR:
            break
        factor = min(max(factor + by, least), most)
        if math.isfinite(width):
            share = below[1] / (below[1] - above[1])
            factor = below[0] + min(max(share, INNER), 1.0 - INNER) * width
    name, *_ = (p.name for p in catalogue()[effect].parameters if p.power != 0.0)
    if below[0] >= most:
        return CouldBeSeen(effect, name, math.nan, "none", start)
    near = factor + by if abs(by) < NEAR else above[0]
    found = least if above[0] <= least else min(max(near, least), most)
    sizes = scaled(effect, start, found)
    return CouldBeSeen(
        effect, name, sizes[name], "least_size" if found <= least else "record", sizes
    )


def _range(case: Case, effect: str, start: Mapping[str, float]) -> tuple[float, float]:
    """The ln of the factors of the least size that matters, and of the largest in the bounds."""
    info, scale = catalogue()[effect], machine_scale(case.rig)
    most = WIDEST
    for parameter in info.parameters:
        size, power = abs(start[parameter.name] - parameter.neutral), parameter.power
        end = (parameter.maximum if power > 0.0 else parameter.minimum) - parameter.neutral
        if parameter.unit == "N":  # against a larger force the machine does not move
            end = min(end, scale.force_n)
        if power != 0.0 and size > 0.0 and end > 0.0:
            most = min(most, math.log(end / size) / power)
    low, high = -WIDEST, 0.0
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        if info.matters(scaled(effect, start, middle), scale):
            high = middle
        else:
            low = middle
    return high, most


def stays(ground: Ground, effect: str, sizes: Mapping[str, float]) -> FloatArray:
    """What the values of the rig leave of an effect of these sizes, power, (outputs, BANDS).

    It is infinite where the simulation diverges.
    """
    problem, linear = shown(ground, effect, sizes)
    if linear is None:
        return np.full(ground.left.shape, np.inf)
    _, promised = linear_refit(problem, linear, ground.x)
    return _refit(problem, linear, ground.x, ground.x, promised)[0]


def beyond(ground: Ground, effect: str, sizes: Mapping[str, float]) -> float:
    """How far records are above what suffices to see an effect of these sizes; 0 just suffices."""
    return _excess(ground, effect, sizes, stays(ground, effect, sizes), 0.0)


def shown(ground: Ground, effect: str, sizes: Mapping[str, float]) -> tuple[Problem, Linear | None]:
    """The problem of explaining what an effect shows, linearised; None where it diverges."""
    with_effect = ground.case.problem((*ground.effects, effect), laws=ground.laws)
    own = [x for _, x in effect_parameters(effect, sizes, ground.case.rig.plant)]
    before = ground.x.size - sum(law.knots.size for law in ground.laws)
    x = np.concatenate([ground.x[:before], own, ground.x[before:]])
    simulated = with_effect.simulate(x)
    problem = ground.problem.explaining(simulated, ground.x, ground.left)
    of_effect = ground.problem.coefficients_of(simulated)
    if not all(np.isfinite(each).all() for each in of_effect.values()):
        return problem, None
    errors = {name: ground.linear.errors[name] - of_effect[name] for name in of_effect}
    return problem, ground.linear.at(errors)


def _refit(
    problem: Problem, linear: Linear, x: FloatArray, start: FloatArray, promised: float
) -> tuple[FloatArray, FloatArray]:
    """Powers, (outputs, BANDS), that a fit leaves, and its values.

    linear: at x, where the sensitivities promise a cost, nats. The fit ends where a step gains
    little twice and the promise is kept: else small steps may come before large ones.
    """
    nothing = problem.fit_cost({name: 0.0 * each for name, each in linear.errors.items()})
    start = np.clip(start, problem.low, problem.high)
    first = linear if start is x else linear.at(problem.coefficients(start))
    before, little = math.inf, 0
    for step in itertools.islice(descent(problem, start, first), FIT_STEPS):
        above = step.cost - nothing
        little = little + 1 if before - step.cost < LITTLE * above else 0
        if little == ENOUGH and step.cost - promised < AS_PROMISED * above:
            break
        before = step.cost
    coefficients = problem.coefficients(step.x)
    powers = [problem.spectrum.powers(coefficients[name]) for name in problem.outputs]
    return np.stack(powers), step.x


def linear_refit(problem: Problem, linear: Linear, x: FloatArray) -> tuple[FloatArray, float]:
    """Powers, (outputs, BANDS), and cost, nats, of the best change by the sensitivities alone."""
    prior = problem.information()
    power, change = reweighted(
        quadratic(problem, linear), prior, np.zeros_like(x), problem.low - x, problem.high - x
    )
    powers = np.zeros(_counts(problem).shape)
    powers[_counts(problem) > 0.0] = power
    costs = [problem.likelihoods[name].cost_of(powers[k]) for k, name in enumerate(problem.outputs)]
    return powers, sum(costs) + 0.5 * float(prior @ change**2)


def _counts(problem: Problem) -> FloatArray:
    """Number of independent errors, shape (outputs, BANDS)."""
    return np.stack([problem.likelihoods[name].counts for name in problem.outputs])


def _excess(
    ground: Ground, effect: str, sizes: Mapping[str, float], powers: FloatArray, by: float
) -> float:
    """How far what stays of an effect of these sizes is above what suffices to name it; >= 0: seen.

    powers: those that stay, shape (outputs, BANDS), taken to be larger by 2 `by`, ln.
    """
    if not np.isfinite(powers).all():
        return math.inf
    counts = _counts(ground.problem)
    tolerated = [ground.problem.likelihoods[name].tolerated for name in ground.problem.outputs]
    other = ground.left + np.stack(tolerated)
    stay = math.exp(2.0 * by) * powers
    scale = EVIDENCE / counts.sum()
    gain = 0.5 * scale * float(np.sum(counts * np.log1p(stay / other)))
    # Errors and what stays may agree by chance: their product has the variance 4 P D / n.
    variance = counts * stay * ground.left / (stay + other) ** 2
    chance = scale * math.sqrt(float(variance.sum()))
    above = margin(effect, effect_values(effect, sizes), ground.case.rig)
    price = EFFECT * law_count((effect,)) + SMALL * (1.0 - above) + math.log(FALSE_ALARM / MISSED)
    # Whitened by what stays in any case, the effect is a signal in white noise.
    distance = math.sqrt(float(np.sum(counts * stay / np.maximum(ground.left, 1e-300))))
    return float(min((gain - OF_POWER * chance) / price, distance / (OF_POWER + OF_ALARM)) - 1.0)


def _needed(excess: Callable[[float], float]) -> float:
    """The ln of the smallest factor, in +-WIDEST, at which the excess is not negative."""
    low, high = -WIDEST, WIDEST
    while high - low > 0.1 * NEAR:
        middle = 0.5 * (low + high)
        if excess(middle) >= 0.0:
            high = middle
        else:
            low = middle
    return high
