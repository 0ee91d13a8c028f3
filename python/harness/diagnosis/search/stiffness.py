# SPDX-License-Identifier: MIT
"""Starts with several stiffnesses of the oil, for slowly sampled records.

Where the sampling does not follow the oil spring, there are no short windows in which its phase
could be followed, and the cost has a minimum at each of many frequencies.
"""

from __future__ import annotations

import numpy as np

from ...base.numbers import FloatArray
from ...rigs.rig import MOST_SIGMAS
from ..model.problem import Problem

STIFFNESS = "fluid.bulk_modulus_pa"
# The stiffness is tried in this many steps over its whole range, and fits start from the best few.
# With a standard deviation of 30 %, neighbouring steps differ by 4 % in the frequency of the oil
# spring.
STEPS = 33
STARTS = 3


def stiffness_starts(problem: Problem, about: FloatArray) -> list[FloatArray]:
    """Returns x at the minima of the cost over the stiffness alone, lowest cost first.

    problem: has rig values and effects. about: x, of which all but the stiffness is kept. Empty
    where the rig has no stiffness.
    """
    names = [parameter.name for parameter in problem.parameters]
    if STIFFNESS not in names:
        return []
    index = names.index(STIFFNESS)
    parameter = problem.parameters[index]
    trials = []
    for step in np.linspace(-MOST_SIGMAS, MOST_SIGMAS, STEPS):
        trial = about.copy()
        place = parameter.centre + step * parameter.sigma
        trial[index] = min(max(place, parameter.low), parameter.high)
        trials.append(trial)
    costs = np.array([problem.cost(trial) for trial in trials])
    padded = np.pad(costs, 1, constant_values=np.inf)
    minima = np.flatnonzero((costs <= padded[:-2]) & (costs <= padded[2:]))
    return [trials[k] for k in sorted(minima, key=lambda k: float(costs[k]))][:STARTS]
