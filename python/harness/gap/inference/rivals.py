# SPDX-License-Identifier: MIT
"""Fits of the calibration alone and together with effects, each with the same budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.fit import Fit, fit
from ehsid.harness.gap.model.parameters import effect_parameters
from ehsid.harness.gap.model.problem import Linear, Problem
from ehsid.harness.gap.model.starts import SIMPLER, effect_starts, grown_start
from ehsid.harness.gap.thresholds import (
    COLD_WINDOWS_S,
    DECISION_SUBSTEPS,
    ITERATIONS,
    ITERATIONS_COLD,
    ITERATIONS_FINE,
    ITERATIONS_SCREEN,
    SLEWS_1_S,
)
from ehsid.harness.rigs.parameters import EFFECT_PREFIX, NUISANCE_PREFIX

SLEW = "nuisance.spool_slew_1_s"


@dataclass(frozen=True, eq=False)
class Rival:
    """An explanation: the calibrated rig with some effects.

    Attributes
    ----------
    effects
        ids, none for the calibration alone.
    x
        shape (n,), as `Case.parameters(effects)`.
    values
        of the plant by full name.
    cost
        on the training records, prior included.
    held_out_cost
        on the held-out records, without the prior.
    converged
        the fit ended by itself.
    squares, counts
        of the held-out errors by window: sums, shape (W, outputs), and samples, shape (W,).
    """

    effects: tuple[str, ...]
    x: FloatArray
    values: Mapping[str, float]
    cost: float
    held_out_cost: float
    converged: bool
    squares: FloatArray
    counts: FloatArray


def _rival(case: Case, effects: tuple[str, ...], found: Fit) -> Rival:
    held_out = case.problem(effects, held_out=True)
    values = {p.name: p.value(float(x)) for p, x in zip(held_out.parameters, found.x, strict=True)}
    errors = held_out.errors(found.x)
    squares, counts = held_out.window_squares(errors)
    return Rival(
        effects,
        found.x,
        values,
        found.cost,
        held_out.fit_cost(errors),
        found.converged,
        squares,
        counts,
    )


def _best(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=lambda one: one.cost)


def decisive(case: Case) -> Case:
    """The same with the steps of integration that decide."""
    return replace(case, substeps=max(case.substeps, DECISION_SUBSTEPS))


def as_told(case: Case) -> Rival:
    """The rig without any fit, nuisances at their typical values."""
    problem = decisive(case).problem()
    x = problem.centre()
    return _rival(decisive(case), (), Fit(x, problem.cost(x), 0, True))


def calibrate(case: Case, starts: Sequence[FloatArray] = ()) -> Rival:
    """The rig alone, from its priors, cold with short windows first, and from any other start.

    A cold start into windows of half a second can settle on a wrong multiple of a limit cycle; in
    short ones it cannot.
    """
    problem = case.problem()
    cold = problem.centre()
    for window_s in COLD_WINDOWS_S:
        subject = case.problem(window_s=window_s, all_states=True)
        cold = fit(subject, cold, iterations=ITERATIONS_COLD).x
    found = _from_all(problem, [cold, problem.centre(), *starts])
    return polish(case, (), found.x)


def _from_all(problem: Problem, starts: Sequence[FloatArray]) -> Fit:
    """The best of all starts, and of a slower spool from there."""
    best = _best([fit(problem, start, iterations=ITERATIONS) for start in starts])
    slower = _slower_spool(problem, best)
    return best if slower is None else _best([best, fit(problem, slower, iterations=ITERATIONS)])


def _slower_spool(problem: Problem, best: Fit) -> FloatArray | None:
    """The same values with the limit of the spool's speed that does best, if that is better.

    A limit that nothing reaches has no slope.
    """
    names = [parameter.name for parameter in problem.parameters]
    if SLEW not in names:
        return None
    place = names.index(SLEW)
    trials = []
    for slew in SLEWS_1_S:
        x = best.x.copy()
        x[place] = problem.parameters[place].place(slew)
        trials.append((problem.cost(x), tuple(x)))
    cost, found = min(trials)
    return np.array(found) if cost < best.cost else None


@dataclass(frozen=True, eq=False)
class Base:
    """Values to start from, shape (n,), with the sensitivities there."""

    x: FloatArray
    linear: Linear


def base(case: Case, effects: tuple[str, ...], x: FloatArray) -> Base:
    """The values of a rival as a base."""
    return Base(x, case.problem(effects).linear(x))


def values_as_told(case: Case, calibrated: Rival) -> Rival:
    """Only what no data sheet tells is fitted; the rig's own values stay as told."""
    fine = decisive(case)
    coarse, exact = case.problem(), fine.problem()
    told = [not one.name.startswith(NUISANCE_PREFIX) for one in coarse.parameters]
    centre = coarse.centre()
    for problem in (coarse, exact):
        problem.low = np.where(told, centre, problem.low)
        problem.high = np.where(told, centre, problem.high)
    near = _from_all(coarse, [calibrated.x, centre])
    # Held values make the valley narrow: twice the steps.
    near = fit(coarse, near.x, iterations=ITERATIONS)
    return _rival(fine, (), fit(exact, near.x, iterations=ITERATIONS_FINE))


def screen(case: Case, effects: tuple[str, ...], bases: Sequence[Base]) -> Rival:
    """A short fit with the last effect from each of its active sizes; the best of them.

    bases: values of calibration and all effects but the last to start from. A calibration without
    the effect may have gone far to hide it, so that the values as told are a base of their own.
    """
    problem = case.problem(effects)
    effect = effects[-1]
    fits = []
    for start in effect_starts(effect, case.rig):
        size = [x for _, x in effect_parameters(effect, start, case.rig.plant)]
        fits += [
            fit(
                problem,
                np.concatenate([one.x, size]),
                iterations=ITERATIONS_SCREEN,
                first=one.linear,
            )
            for one in bases
        ]
    simpler = SIMPLER.get(effect)
    if simpler is not None and simpler not in effects:
        # Its minimum is far narrower than that of the simpler law, and near it.
        less = screen(case, (*effects[:-1], simpler), bases)
        force_n = less.values[f"{EFFECT_PREFIX}{simpler}.force_n"]
        grown = effect_parameters(effect, grown_start(effect, force_n, case.rig), case.rig.plant)
        start_x = np.concatenate([less.x[:-1], [x for _, x in grown]])
        fits.append(fit(problem, start_x, iterations=ITERATIONS_SCREEN))
    return _rival(case, effects, _best(fits))


def polish(case: Case, effects: tuple[str, ...], start: FloatArray) -> Rival:
    """The long fit, at the steps of integration that decide."""
    near = fit(case.problem(effects), start, iterations=ITERATIONS)
    fine = decisive(case)
    if fine.substeps == case.substeps:
        return _rival(case, effects, near)
    return _rival(fine, effects, fit(fine.problem(effects), near.x, iterations=ITERATIONS_FINE))
