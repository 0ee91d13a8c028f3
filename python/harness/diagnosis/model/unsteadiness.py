# SPDX-License-Identifier: MIT
"""Motions whose phase no simulator keeps: those that stick and slip, and limit cycles.

Two simulations of a steady motion whose values differ by a share differ by about that share. Where
the rod sticks and slips, or swings by itself, they differ by more and more until they have nothing
in common: when it breaks away next depends on all before. What such a motion leaves is then no
evidence for a further cause. The simulator is run again with values that differ by TOLERANCE, the
share to which no simulator is exact, in either sense. The power of the difference, as far as it is
beyond what all values together do to a steady motion, is that of the lost phase.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.spellings import ParameterKey
from ..deciding import TOLERANCE
from .problem import CENTRED, Problem

# Share of the motion by which a simulation of a steady motion may differ, in units of TOLERANCE:
# some twenty values with random signs.
OF_STEADY = 5.0
RUNS = 2
SEED = 21


def lost_phase_power(problem: Problem, x: FloatArray) -> Mapping[str, FloatArray]:
    """Power by output and octave, (BANDS,) each, of a phase that is lost; 0 of a steady motion.

    problem, x: a fit.
    """
    rng = np.random.default_rng(SEED)
    here = problem.simulate(x)
    powers: dict[str, list[FloatArray]] = {name: [] for name in problem.outputs}
    for _ in range(RUNS):
        there = problem.simulate(_moved(problem, x, rng))
        for name, of_runs in powers.items():
            differences = [
                record.inside(after[name] - before[name])
                for record, after, before in zip(problem.records, there, here, strict=True)
            ]
            of_runs.append(_powers(problem, name, differences))
    lost = {}
    for name, of_runs in powers.items():
        motion = [record.inside(record.outputs[name]) for record in problem.records]
        steady = (OF_STEADY * TOLERANCE) ** 2 * _powers(problem, name, motion)
        lost[name] = np.maximum(np.mean(of_runs, axis=0) - steady, 0.0)
    return lost


def _moved(problem: Problem, x: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The values of the rig and the sizes of effects, each by TOLERANCE up or down."""
    moved = x.copy()
    for place, parameter in enumerate(problem.parameters[: x.size]):
        key = ParameterKey(parameter.name)
        if parameter.low < parameter.high and not key.is_nuisance:
            step = TOLERANCE * (1.0 if parameter.logarithmic else abs(x[place]))
            moved[place] += step * rng.choice([-1.0, 1.0])
    return np.clip(moved, problem.low, problem.high)


def _powers(problem: Problem, name: str, signals: list[FloatArray]) -> FloatArray:
    coefficients = problem.spectrum.transform(signals, differences=name == CENTRED)
    return problem.spectrum.powers(coefficients)
