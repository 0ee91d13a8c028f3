# SPDX-License-Identifier: MIT
"""Log-likelihood by which a record separates candidates after each of them is fitted to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.keys import sizes_of
from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.gap.model.comparison import Compared, compare
from ehsid.harness.gap.model.fit import fit
from ehsid.harness.gap.model.parameters import Parameter, calibration_parameters, effect_parameters
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.thresholds import (
    DESIGN_ERROR,
    INDEPENDENT_HZ,
    ITERATIONS,
    SEPARATED_NATS,
    SUBSTEPS,
)
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import simulate

# A candidate: its effects, and its values of the plant by full name.
CandidateModel = tuple[tuple[str, ...], Mapping[str, float]]


@dataclass(frozen=True)
class Separation:
    """Separation of a candidate from the best candidate by a record.

    Attributes
    ----------
    nats
        log-likelihood over all windows by which the candidate, fitted to the record, is below the
        best candidate.
    deviation
        standard deviation of this sum, nats, by the scatter over the windows and by the noise.
    """

    nats: float
    deviation: float

    @property
    def power(self) -> float:
        """Probability that the log-likelihood difference exceeds SEPARATED_NATS.

        P = Phi((nats - SEPARATED_NATS) / deviation), because a sum over windows is nearly normal.
        """
        if self.deviation <= 0.0:
            return float(self.nats > SEPARATED_NATS)
        return float(norm.cdf((self.nats - SEPARATED_NATS) / self.deviation))


def parameters_of(rig: Rig, candidate: CandidateModel) -> tuple[tuple[Parameter, ...], FloatArray]:
    """Returns the parameters of calibration and effects of a candidate, and their x, shape (n,)."""
    effects, values = candidate
    parameters = list(calibration_parameters(rig))
    x = [p.place(values[p.name]) if p.name in values else p.centre for p in parameters]
    for effect in effects:
        for parameter, place in effect_parameters(effect, sizes_of(effect, values), rig.plant):
            parameters.append(parameter)
            x.append(place)
    return tuple(parameters), np.array(x)


def separations(
    rig: Rig,
    candidates: Sequence[CandidateModel],
    record: Record,
    floors: Mapping[str, float],
    *,
    iterations: int = ITERATIONS,
) -> list[Separation]:
    """Computes the log-likelihood by which a record separates each candidate from the best one.

    All candidates are fitted to the record. With the mean square ms_w of the errors in window w,
    the mean square ms over all windows, and the noise floor f:

        nats = sum_w sum_outputs (n_w / 2) (ms_w(other) - ms_w(best)) / v,
        v = (ms(other) + ms(best)) / 2 + 2 f^2,

    The record is a simulation of the best candidate. The sum is the difference of the cost
    (n / 2) ln(ms + f^2), on records with noise of standard deviation f, to first order about the
    mean of both ms. Its variance is the sum of the variance over windows and the variance by noise,
    n_w |ms_w(other) - ms_w(best)| f^2 / v^2.

    A candidate that contains the best one can always reproduce its outputs. The question is then
    whether the best one can reproduce those of the larger candidate. The record is therefore
    replaced by the outputs of the larger candidate on the same command.

    Parameters
    ----------
    rig
        the rig as configured in the rig file.
    candidates
        effects and values of each candidate, the best first; at least two.
    record
        record without noise: the command, and the outputs of the best candidate.
    floors
        standard deviation of the noise, by measured output.
    iterations
        largest number of steps of each fit.
    """
    best, compared = candidates[0], compare(record)
    errors = _fitted_errors(rig, best, compared, floors, iterations)
    results = []
    for other in candidates[1:]:
        if contains(other[0], best[0]):
            replayed = compare(_replayed(rig, other, record))
            pair = [
                _fitted_errors(rig, candidate, replayed, floors, iterations)
                for candidate in (other, best)
            ]
            results.append(_separation(replayed, floors, *pair))
        else:
            fitted = _fitted_errors(rig, other, compared, floors, iterations)
            results.append(_separation(compared, floors, errors, fitted))
    return results


def contains(larger: Sequence[str], smaller: Sequence[str]) -> bool:
    """Whether the larger set of effects can reproduce every behaviour of the smaller one."""
    able = {*larger, *(catalogue()[effect].contains for effect in larger)}
    return set(smaller) <= able


def _replayed(rig: Rig, candidate: CandidateModel, record: Record) -> Record:
    """Simulates a candidate on the command of a record, from the initial position of the record."""
    assert record.dt_s is not None
    start = float(record.column("position_m")[0])
    command = record.column("command_v")
    return simulate(
        rig, command, dt_s=record.dt_s, position0_m=start, values=dict(candidate[1])
    ).record


def _fitted_errors(
    rig: Rig,
    candidate: CandidateModel,
    compared: Compared,
    floors: Mapping[str, float],
    iterations: int,
) -> dict[str, FloatArray]:
    """Errors inside the windows after a fit that starts at the values of a candidate, by output."""
    parameters, x = parameters_of(rig, candidate)
    problem = Problem(
        rig,
        [compared],
        parameters,
        outputs=tuple(floors),
        floors=floors,
        substeps=SUBSTEPS,
        fixed=dict(candidate[1]),
    )
    return problem.errors(fit(problem, x, iterations=iterations).x)


def _separation(
    compared: Compared,
    floors: Mapping[str, float],
    best: Mapping[str, FloatArray],
    other: Mapping[str, FloatArray],
) -> Separation:
    if any(
        _rms(best[name]) > _largest_acceptable_error(compared, name, floor)
        for name, floor in floors.items()
    ):
        # The integration steps of the fits are too long for this record. It has no information.
        return Separation(0.0, 0.0)
    number = compared.window[compared.used]
    counts = np.bincount(number)
    n_w = INDEPENDENT_HZ * compared.dt_s * counts
    gains, noise = np.zeros(counts.size), 0.0
    for name, floor in floors.items():
        squares = [np.bincount(number, errors[name] ** 2) for errors in (best, other)]
        v = 0.5 * float(squares[0].sum() + squares[1].sum()) / number.size + 2.0 * floor**2
        increase = (squares[1] - squares[0]) / counts
        gains += 0.5 * n_w * increase / v
        noise += float(np.sum(n_w * np.abs(increase))) * floor**2 / v**2
    scatter = gains.size * float(np.var(gains, ddof=1)) if gains.size > 1 else 0.0
    return Separation(float(gains.sum()), float(np.sqrt(scatter + noise)))


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _largest_acceptable_error(compared: Compared, name: str, floor: float) -> float:
    """Largest acceptable rms error of the best candidate on its own record, unit of the output."""
    spread = _rms(compared.centred(compared.outputs[name]))
    return max(floor, DESIGN_ERROR * spread)
