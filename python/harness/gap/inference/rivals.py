# SPDX-License-Identifier: MIT
"""Fits of candidates: the calibration alone or with effects, each with the same budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.keys import ParameterKey, sizes_of
from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.fit import Fit, fit
from ehsid.harness.gap.model.machine import effect_starts, machine_scale
from ehsid.harness.gap.model.parameters import effect_parameters
from ehsid.harness.gap.model.problem import Linear, Problem
from ehsid.harness.gap.thresholds import (
    COLD_WINDOWS_S,
    DECISION_SUBSTEPS,
    ITERATIONS,
    ITERATIONS_COLD,
    ITERATIONS_FINE,
    ITERATIONS_SCREEN,
    SLEWS_1_S,
)

SLEW = "nuisance.spool_slew_1_s"


@dataclass(frozen=True, eq=False)
class Rival:
    """Candidate explanation of the records: the calibrated rig with a set of effects.

    Attributes
    ----------
    effects
        ids of the effects; none for the calibration alone.
    x
        fitted parameters, shape (n,), in the order of `Case.parameters(effects)`.
    values
        the same as values of the plant, by full name.
    cost
        cost on the training records, prior included, nats.
    held_out_cost
        cost on the held-out records, without the prior, nats.
    converged
        whether the fit converged within its iterations.
    squares, counts
        held-out errors by window: sums of squares, shape (W, outputs), and numbers of samples,
        shape (W,).
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
    """Returns the case with the finer integration steps that decisions are based on."""
    return replace(case, substeps=max(case.substeps, DECISION_SUBSTEPS))


def as_told(case: Case) -> Rival:
    """Returns the rig as configured, without any fit, with nuisances at their typical values."""
    problem = decisive(case).problem()
    x = problem.centre()
    return _rival(decisive(case), (), Fit(x, problem.cost(x), 0, True))


def calibrate(case: Case, starts: Sequence[FloatArray] = ()) -> Rival:
    """Fits the rig without effects, from its priors and from any other starts.

    From the priors it starts directly, and also by way of short windows: in windows of half a
    second a cold start can settle on a wrong multiple of a limit cycle, in short ones it cannot.
    """
    problem = case.problem()
    cold = problem.centre()
    for window_s in COLD_WINDOWS_S:
        subject = case.problem(window_s=window_s, all_states=True)
        cold = fit(subject, cold, iterations=ITERATIONS_COLD).x
    found = _from_all(problem, [cold, problem.centre(), *starts])
    return polish(case, (), found.x)


def _from_all(problem: Problem, starts: Sequence[FloatArray]) -> Fit:
    """Fits from all starts, then from the best with a slower spool; returns the best fit."""
    best = _best([fit(problem, start, iterations=ITERATIONS) for start in starts])
    slower = _slower_spool(problem, best)
    return best if slower is None else _best([best, fit(problem, slower, iterations=ITERATIONS)])


def _slower_spool(problem: Problem, best: Fit) -> FloatArray | None:
    """Returns the values with the best limit of the spool's speed if that lowers the cost, or None.

    Several limits are tried, because the cost has no gradient by a limit that nothing reaches.
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
    """Values from which a fit starts, shape (n,), with the sensitivities of the errors there."""

    x: FloatArray
    linear: Linear


def base(case: Case, effects: tuple[str, ...], x: FloatArray) -> Base:
    """Returns the values of a candidate as a base."""
    return Base(x, case.problem(effects).linear(x))


def values_as_told(case: Case, calibrated: Rival) -> Rival:
    """Fits the nuisances only; the rig's own values stay as in the rig file."""
    fine = decisive(case)
    coarse, exact = case.problem(), fine.problem()
    told = [not ParameterKey(one.name).is_nuisance for one in coarse.parameters]
    centre = coarse.centre()
    for problem in (coarse, exact):
        problem.low = np.where(told, centre, problem.low)
        problem.high = np.where(told, centre, problem.high)
    near = _from_all(coarse, [calibrated.x, centre])
    # Held values make the minimum narrow, so that the fit needs twice the steps.
    near = fit(coarse, near.x, iterations=ITERATIONS)
    return _rival(fine, (), fit(exact, near.x, iterations=ITERATIONS_FINE))


def screen(case: Case, effects: tuple[str, ...], bases: Sequence[Base]) -> Rival:
    """Makes short fits from each active size of the last effect and each base; returns the best.

    bases: values of the calibration and of all effects but the last, to start from. A calibration
    without the effect may have moved far to hide it, so that the values in the rig file are a base
    of their own.
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
    simpler = catalogue()[effect].contains
    if simpler is not None and simpler not in effects:
        # The minimum of the cost is far narrower than that of the simpler law, and near it.
        less = screen(case, (*effects[:-1], simpler), bases)
        simple = sizes_of(simpler, less.values)
        start = catalogue()[effect].grown(simple, machine_scale(case.rig))
        grown = effect_parameters(effect, start, case.rig.plant)
        start_x = np.concatenate([less.x[:-1], [x for _, x in grown]])
        fits.append(fit(problem, start_x, iterations=ITERATIONS_SCREEN))
    return _rival(case, effects, _best(fits))


def polish(case: Case, effects: tuple[str, ...], start: FloatArray) -> Rival:
    """Makes the long fit, which ends with the integration steps that decisions are based on."""
    near = fit(case.problem(effects), start, iterations=ITERATIONS)
    fine = decisive(case)
    if fine.substeps == case.substeps:
        return _rival(case, effects, near)
    return _rival(fine, effects, fit(fine.problem(effects), near.x, iterations=ITERATIONS_FINE))
