# SPDX-License-Identifier: MIT
"""Fits of the calibration alone and together with effects, each with the same budget."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
import numpy.typing as npt

from ehsid.harness.gap.case import Case
from ehsid.harness.gap.fit import Fit, fit
from ehsid.harness.gap.parameters import effect_parameters
from ehsid.harness.gap.starts import effect_starts
from ehsid.harness.gap.thresholds import COLD_WINDOWS_S, ITERATIONS, ITERATIONS_COLD
from ehsid.harness.parallel import Progress, run_tasks

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
    """

    effects: tuple[str, ...]
    x: FloatArray
    values: Mapping[str, float]
    cost: float
    held_out_cost: float
    converged: bool


def _rival(case: Case, effects: tuple[str, ...], found: Fit) -> Rival:
    held_out = case.problem(effects, held_out=True)
    parameters = case.parameters(effects)
    values = {p.name: p.value(float(x)) for p, x in zip(parameters, found.x, strict=True)}
    return Rival(
        effects,
        found.x,
        values,
        found.cost,
        held_out.fit_cost(held_out.errors(found.x)),
        found.converged,
    )


def _best(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=lambda one: one.cost)


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
    return _rival(case, (), _best(fits))


def fit_effects(case: Case, effects: tuple[str, ...], bases: Sequence[FloatArray]) -> Rival:
    """Calibration and effects together, from every active size and every base.

    Parameters
    ----------
    case
        records and rig.
    effects
        ids, at least one.
    bases
        calibration parameters to start from, each shape (n,).
    """
    problem = case.problem(effects)
    sizes = [
        [
            [x for _, x in effect_parameters(effect, start, case.rig.plant)]
            for start in effect_starts(effect, case.rig)
        ]
        for effect in effects
    ]
    fits = [
        fit(problem, np.concatenate([base, *map(np.array, chosen)]), iterations=ITERATIONS)
        for base in bases
        for chosen in product(*sizes)
    ]
    return _rival(case, effects, _best(fits))


def fit_all(
    case: Case,
    rivals: Sequence[tuple[str, ...]],
    bases: Sequence[FloatArray],
    progress: Progress | None = None,
) -> list[Rival]:
    """Several sets of effects on all cores, in the order given; the result hangs on no worker."""
    tasks: list[Callable[[], Rival]] = [
        partial(fit_effects, case, effects, list(bases)) for effects in rivals
    ]
    return run_tasks(tasks, progress)
