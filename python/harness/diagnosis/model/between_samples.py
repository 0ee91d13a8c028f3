# SPDX-License-Identifier: MIT
"""What a record does not tell of the command between its samples, as a part of what is tolerated.

A controller may send several commands for each one that is logged. The mean course between two
samples is the nuisance `between_samples`, b: 0 where the command is held, 1/2 where two commands
are sent for each sample. What a single command in between is remains unknown. That of a controller
of twice the rate differs from the mean of its neighbours by about

    d_k = r |u_k - (u_k-1 + u_k+1) / 2|,   r = rms(u_k - (u_k-1 + u_k+1) / 2)
                                             / rms(u_k - (u_k-2 + u_k+2) / 2)

as each halving of the distance makes such differences smaller by the same ratio: 1/4 for a smooth
command, 1/sqrt(2) for a random walk. On 16 records of eight generated machines r was 0.7 to 2.1
times the true ratio. The simulator is run with such commands, of random signs. The power of the
difference from its run with the mean course is tolerated in each octave beside the share of the
motion, where the command moves between the samples at all: a controller either holds it or sends
at least two for each sample. A fitted b lies between the two, because a spool that is faster than
the true one looks alike: on 26 generated machines with two commands for each sample it was 0.02
to 1, on 150 with one it was below 0.1 on all but 9.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import ehsid

from ...base.numbers import FloatArray
from ...catalogue.parameters import plant_parameters
from ...signals.simulation.run import OUTPUTS
from .comparison import Compared
from .problem import CENTRED, Problem

NAME = "nuisance.between_samples"
# A move by less than this share of a step is none: fits of held commands end below it.
LEAST_MOVE = 0.1
# Runs with signs of their own, of which the mean power counts; and the seed of the signs.
RUNS = 2
SEED = 20


def unknown_command_power(problem: Problem, x: FloatArray) -> Mapping[str, FloatArray]:
    """Power by output and octave, (BANDS,) each, of commands that nobody logged; empty if none.

    problem, x: the fit that tells whether the command moves between samples.
    """
    places = [i for i, each in enumerate(problem.parameters) if each.name == NAME]
    if not places or x[places[0]] < LEAST_MOVE:
        return {}
    values = problem.plant_values(x)
    place = list(plant_parameters()).index(NAME)
    values[place] = 0.0
    halves = values.copy()
    halves[place] = 0.5
    rng = np.random.default_rng(SEED)
    powers: dict[str, list[FloatArray]] = {name: [] for name in problem.outputs}
    means = [_outputs(problem, record, halves) for record in problem.records]
    for _ in range(RUNS):
        runs = [
            _outputs(problem, record, values, _between(record, rng)) for record in problem.records
        ]
        for name, of_runs in powers.items():
            column = OUTPUTS.index(name)
            difference = [
                record.inside(run[:, column] - mean[:, column])
                for record, run, mean in zip(problem.records, runs, means, strict=True)
            ]
            of_runs.append(
                problem.spectrum.powers(
                    problem.spectrum.transform(difference, differences=name == CENTRED)
                )
            )
    unknown = {name: np.mean(of_runs, axis=0) for name, of_runs in powers.items()}
    if all((power <= problem.likelihoods[name].tolerated).all() for name, power in unknown.items()):
        return {}  # the log is fast enough for these commands
    return unknown


def _between(record: Compared, rng: np.random.Generator) -> FloatArray:
    """Commands that may have been sent in the middle of each sample, V, shape (N,)."""
    command = record.record.column("command_v")
    near, far = (
        command - 0.5 * (ends[: -2 * k] + ends[2 * k :])
        for k, ends in ((k, np.pad(command, k, mode="edge")) for k in (1, 2))
    )
    of_far = float(np.sqrt(np.mean(far**2)))
    ratio = min(float(np.sqrt(np.mean(near**2))) / of_far, 1.0) if of_far > 0.0 else 0.0
    size = ratio * np.abs(near)
    next_one = np.append(command[1:], command[-1])
    return np.asarray(
        0.5 * (command + next_one) + size * rng.choice([-1.0, 1.0], size.size), dtype=np.float64
    )


def _outputs(
    problem: Problem, record: Compared, values: FloatArray, between: FloatArray | None = None
) -> FloatArray:
    """Outputs at the samples, shape (N, outputs), perhaps with commands between them."""
    command, aligned = record.record.column("command_v"), record.aligned
    parts = 1 if between is None else 2
    if between is not None:
        command = np.stack([command, between], axis=1).ravel()
        finer = np.full((2 * aligned.shape[0], aligned.shape[1]), np.nan)
        finer[::2] = aligned
        aligned = finer
    outputs, _ = ehsid.simulate_plant(
        problem.rig.plant,
        values[np.newaxis],
        command,
        dt_s=record.dt_s / parts,
        substeps=-(-problem.substeps // parts),
        aligned=aligned,
        tables=problem.rig.table_shapes(),
    )
    return np.asarray(outputs[0, ::parts], dtype=np.float64)
