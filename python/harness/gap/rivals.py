# SPDX-License-Identifier: MIT
"""Fits of the calibration alone and together with effects, each with the same budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ehsid.harness.gap.case import Case
from ehsid.harness.gap.fit import Fit, fit
from ehsid.harness.gap.parameters import effect_parameters
from ehsid.harness.gap.problem import Linear
from ehsid.harness.gap.starts import effect_starts
from ehsid.harness.gap.thresholds import (
    COLD_WINDOWS_S,
    DECISION_SUBSTEPS,
    ITERATIONS,
    ITERATIONS_COLD,
    ITERATIONS_FINE,
    ITERATIONS_SCREEN,
)

FloatArray = npt.NDArray[np.float64]


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
    fits = [
        fit(problem, start, iterations=ITERATIONS) for start in (cold, problem.centre(), *starts)
    ]
    return polish(case, (), _best(fits).x)


@dataclass(frozen=True, eq=False)
class Base:
    """Values to start from, shape (n,), with the sensitivities there."""

    x: FloatArray
    linear: Linear


def base(case: Case, effects: tuple[str, ...], x: FloatArray) -> Base:
    """The values of a rival as a base."""
    return Base(x, case.problem(effects).linear(x))


def screen(case: Case, effects: tuple[str, ...], bases: Sequence[Base]) -> Rival:
    """A short fit with the last effect from each of its active sizes; the best of them.

    bases: values of calibration and all effects but the last to start from. A calibration without
    the effect may have gone far to hide it, so that the values as told are a base of their own.
    """
    problem = case.problem(effects)
    fits = []
    for start in effect_starts(effects[-1], case.rig):
        size = [x for _, x in effect_parameters(effects[-1], start, case.rig.plant)]
        fits += [
            fit(
                problem,
                np.concatenate([one.x, size]),
                iterations=ITERATIONS_SCREEN,
                first=one.linear,
            )
            for one in bases
        ]
    return _rival(case, effects, _best(fits))


def polish(case: Case, effects: tuple[str, ...], start: FloatArray) -> Rival:
    """The long fit, at the steps of integration that decide."""
    near = fit(case.problem(effects), start, iterations=ITERATIONS)
    fine = decisive(case)
    if fine.substeps == case.substeps:
        return _rival(case, effects, near)
    return _rival(fine, effects, fit(fine.problem(effects), near.x, iterations=ITERATIONS_FINE))
