# SPDX-License-Identifier: MIT
"""What no simulator tells of a rod that sticks and slips: when it breaks away next.

The friction at which a rod breaks away differs from one time to the next, and no law of friction is
exact: REPEATS is what is assumed of both together. Where a rod slides and stops once in a while,
errors follow such a difference in proportion. Where it sticks and slips, each break-away moves the
next one, and what such a motion leaves is no evidence for a further cause. Simulations y(+), y(-)
with the sizes of the friction larger and smaller by this share, and y(0) between them, tell both
apart: what is in proportion is odd, and the rest,

    (y(+) + y(-)) / 2 - y(0),

is what is lost.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.parameters import effects
from ...catalogue.spellings import ParameterKey
from ..deciding import REPEATS
from .problem import Problem


def lost_motion_power(problem: Problem, x: FloatArray) -> Mapping[str, FloatArray]:
    """Power by output and octave, (BANDS,) each, of what is lost; empty without friction.

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
    here, larger, smaller = (
        problem.simulate(np.clip(x + sign * steps, problem.low, problem.high))
        for sign in (0.0, 1.0, -1.0)
    )
    even = problem.transformed(
        {
            name: [
                record.inside(0.5 * (up[name] + down[name]) - middle[name])
                for record, middle, up, down in zip(
                    problem.records, here, larger, smaller, strict=True
                )
            ]
            for name in problem.outputs
        }
    )
    return {name: problem.spectrum.powers(coefficients) for name, coefficients in even.items()}


def _is_friction(effect: str | None) -> bool:
    """Whether it is Coulomb friction, or a law that contains it."""
    coulomb = "coulomb_friction"
    return effect is not None and coulomb in (effect, effects()[effect].contains)
