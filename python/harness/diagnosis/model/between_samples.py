# SPDX-License-Identifier: MIT
"""What a record does not tell of the command between its samples, as unknown inputs.

A controller may send several commands for each one that is logged. The mean course between two
samples is the nuisance `between_samples`, b: 0 where the command is held, 1/2 where two commands
are sent for each sample. What a single command in between is remains unknown. In the middle between
samples k and k + 1 it differs from the mean course by about

    s_k = r sqrt((d_k^2 + d_k+1^2) / 2),  d_k = u_k - (u_k-1 + u_k+1) / 2
    r = rms(d_k) / rms(u_k - (u_k-2 + u_k+2) / 2)

as each halving of the distance makes such differences smaller by the same ratio: 1/4 for a smooth
command, 1/sqrt(2) for a random walk. Where r is near 1 the samples tell nothing of each other, and
nothing of what is between them: s_k is then r rms(d) everywhere. On 16 records of eight generated
machines r was 0.7 to 2.1 times the true ratio, so that WIDER s_k counts.

Such commands are unknown inputs of the errors, see `unlogged`. That is linear about the mean
course. What stays of it is tolerated beside the share of the motion: the simulator is run with
commands of random signs, and the power of the whitened difference from its run with the mean course
counts in each octave.

Both are done where the command moves between the samples at all: a controller either holds it or
sends at least two for each sample. A fitted b lies between the two, because a spool that is faster
than the true one looks alike: on 26 generated machines with two commands for each sample it was
0.02 to 1, on 150 with one it was below 0.1 on all but 9. So the mean course is that of b = 1/2
then, or of the b that was found, if that is more than SEVERAL: one more command is sent in the
middle.

One record may have its command held, such as a binary sequence or steps whose changes fall on the
samples, and another one a command that moves. So each record is asked by itself.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial

import numpy as np

import ehsid

from ...base.numbers import FloatArray
from ...catalogue.parameters import plant_parameters
from ...records import Record
from ...signals.simulation.run import OUTPUTS
from .comparison import Compared
from .parameters import Parameter
from .problem import CENTRED, Problem
from .spectrum import Spectrum
from .unlogged import BETWEEN, Whitening, sent_twice, whitening_of

# A move by less than this share of a step is none: fits of held commands end below it.
LEAST_MOVE = 0.1
# From this move on, more than two commands for each sample are likely.
SEVERAL = 0.65
# The deviation that counts, as a multiple of s_k.
WIDER = 2.0
# From this ratio r on, up to 1, samples tell less and less of what is between them; and the share
# of the mean deviation that is possible everywhere.
RANDOM_WALK, ANYWHERE = 0.75, 0.05
# Runs with signs of their own, of which the mean power counts; and the seed of the signs.
RUNS = 2
SEED = 20


def fitted_move(parameters: Sequence[Parameter], x: FloatArray) -> float:
    """The move b, 0 to 1, where a fit ended at x."""
    places = zip(parameters, x, strict=False)
    return next((float(place) for one, place in places if one.name == BETWEEN), 0.0)


def mean_move_of(parameters: Sequence[Parameter], x: FloatArray) -> float | None:
    """The move b that counts where a fit ended at x; None where the command is held."""
    move = fitted_move(parameters, x)
    if move < LEAST_MOVE:
        return None
    return move if move > SEVERAL else 0.5


def course(record: Compared, move: float) -> FloatArray:
    """Mean course of the command in the middle between each sample and the next one, V, (N,)."""
    command = record.record.column("command_v")
    return np.asarray(command + move * np.diff(command, append=command[-1]), dtype=np.float64)


def unknown_command_power(
    problem: Problem, x: FloatArray, move: float, held: Collection[Record] = ()
) -> Mapping[str, FloatArray]:
    """Power by output and octave, (BANDS,) each, of commands that nobody logged; empty if none.

    problem, x: a fit. move: that of the mean course, see `mean_move_of`. held: records in which the
    command is held between the samples.
    """
    unknown_in = [_unknown_in(record, move, held) for record in problem.records]
    rng = np.random.default_rng(SEED)
    powers: dict[str, list[FloatArray]] = {name: [] for name in problem.outputs}
    means = [
        _outputs(problem, record, x, between)
        for record, (between, _) in zip(problem.records, unknown_in, strict=True)
    ]
    for _ in range(RUNS):
        runs = []
        for record, (between, deviation) in zip(problem.records, unknown_in, strict=True):
            signs = rng.choice([-1.0, 1.0], deviation.size)
            runs.append(_outputs(problem, record, x, between + signs * deviation))
        difference = problem.transformed(
            {
                name: [
                    record.inside(run[:, column] - mean[:, column])
                    for record, run, mean in zip(problem.records, runs, means, strict=True)
                ]
                for name, column in _columns(problem).items()
            }
        )
        for name, of_runs in powers.items():
            of_runs.append(problem.spectrum.powers(difference[name]))
    unknown = {name: np.mean(of_runs, axis=0) for name, of_runs in powers.items()}
    if all((power <= problem.likelihoods[name].tolerated).all() for name, power in unknown.items()):
        return {}  # the log is fast enough for these commands
    return unknown


def whitenings(
    problem: Problem, x: FloatArray, move: float, held: Collection[Record] = ()
) -> tuple[Whitening, ...]:
    """The whitening of each record of a problem.

    problem, x: a fit to all windows of the records. move, held: as of `unknown_command_power`.
    """
    columns = _columns(problem)

    def changed(record: Compared, between: FloatArray, signal: FloatArray) -> dict[str, FloatArray]:
        above, below = (
            _outputs(problem, record, x, between + sign * signal) for sign in (1.0, -1.0)
        )
        return {
            name: Spectrum([record]).transform(
                [record.inside(0.5 * (above[:, column] - below[:, column]))],
                differences=name == CENTRED,
            )
            for name, column in columns.items()
        }

    tolerated = {name: problem.likelihoods[name].tolerated for name in problem.outputs}
    return tuple(
        whitening_of(
            record,
            between,
            WIDER * deviation,
            partial(changed, record, between),
            tolerated,
        )
        for record, (between, deviation) in (
            (each, _unknown_in(each, move, held)) for each in problem.records
        )
    )


def _unknown_in(
    record: Compared, move: float, held: Collection[Record]
) -> tuple[FloatArray, FloatArray]:
    """Mean course between the samples, and deviations from it, V, (N,) each."""
    if record.record in held:
        return course(record, 0.0), np.zeros(len(record.record))
    return course(record, move), unknown_commands(record)


def unknown_commands(record: Compared) -> FloatArray:
    """Deviation s_k of the command between each sample and the next from its course, V, (N,)."""
    command = record.record.column("command_v")
    near, far = (
        command - 0.5 * (ends[: -2 * k] + ends[2 * k :])
        for k, ends in ((k, np.pad(command, k, mode="edge")) for k in (1, 2))
    )
    of_near, of_far = (float(np.mean(each**2)) for each in (near, far))
    ratio = min(np.sqrt(of_near / of_far), 1.0) if of_far > 0.0 else 0.0
    # s_k = r sqrt((d_k^2 + d_k+1^2) / 2)
    around = 0.5 * (near**2 + np.append(near[1:], near[-1]) ** 2)
    anywhere = min(max((ratio - RANDOM_WALK) / (1.0 - RANDOM_WALK), 0.0), 1.0)
    power = (1.0 - anywhere) * around + (anywhere + ANYWHERE**2) * of_near
    return np.asarray(ratio * np.sqrt(power), dtype=np.float64)


def _columns(problem: Problem) -> dict[str, int]:
    return {name: OUTPUTS.index(name) for name in problem.outputs}


def _outputs(problem: Problem, record: Compared, x: FloatArray, between: FloatArray) -> FloatArray:
    """Outputs at the samples, shape (N, outputs), with commands in the middle between them."""
    values = problem.plant_values(x)
    values[list(plant_parameters()).index(BETWEEN)] = 0.0
    command, aligned = sent_twice(record.record.column("command_v"), between, record.aligned)
    outputs, _ = ehsid.simulate_plant(
        problem.rig.plant,
        values[np.newaxis],
        command,
        dt_s=record.dt_s / 2,
        substeps=-(-problem.substeps // 2),
        aligned=aligned,
        threads=1,
        tables=problem.rig.table_shapes(),
    )
    return np.asarray(outputs[0, ::2], dtype=np.float64)
