# SPDX-License-Identifier: MIT
"""What no simulator tells of a rod with friction: which friction it has this time.

The friction at which a rod breaks away differs from one time to the next, and no law of friction is
exact: REPEATS is what is assumed of both together. Simulations y(+), y(-) with the sizes of the
friction larger and smaller by this share, and y(0) between them, tell the power

    (|y(+) - y(0)|^2 + |y(-) - y(0)|^2) / 2

of errors that are no evidence for a further cause. Where a rod slides and stops once in a while,
they are in proportion to the difference, and those of one stroke have nothing to do with those of
the next, so that no value of the rig can follow them. Where it sticks and slips, each break-away
moves the next one as well.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.parameters import effects
from ...catalogue.spellings import ParameterKey
from ..deciding import REPEATS
from .problem import Problem


def unsteady_friction_power(problem: Problem, x: FloatArray) -> Mapping[str, FloatArray]:
    """Power by output and octave, (BANDS,) each, of such errors; empty without friction.

    problem, x: a fit.
    """
    places = [
        place
        for place, parameter in enumerate(problem.parameters[: x.size])
        if _is_friction(ParameterKey(parameter.name).effect)
        and parameter.low < parameter.high
        and x[place] != 0.0
    ]
    if not places:
        return {}
    steps = np.zeros(x.size)
    for place in places:
        logarithmic = problem.parameters[place].logarithmic
        steps[place] = REPEATS * (1.0 if logarithmic else abs(x[place]))
    here, *others = (
        problem.simulate(np.clip(x + sign * steps, problem.low, problem.high))
        for sign in (0.0, 1.0, -1.0)
    )
    powers: dict[str, list[FloatArray]] = {name: [] for name in problem.outputs}
    for runs in others:
        changes = problem.transformed(
            {
                name: [
                    record.inside(run[name] - middle[name])
                    for record, middle, run in zip(problem.records, here, runs, strict=True)
                ]
                for name in problem.outputs
            }
        )
        for name, of_runs in powers.items():
            of_runs.append(problem.spectrum.powers(changes[name]))
    return {name: np.mean(of_runs, axis=0) for name, of_runs in powers.items()}


def _is_friction(effect: str | None) -> bool:
    """Whether it is Coulomb friction, or a law that contains it."""
    coulomb = "coulomb_friction"
    return effect is not None and coulomb in (effect, effects()[effect].contains)
