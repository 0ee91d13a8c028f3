# SPDX-License-Identifier: MIT
"""The unknown input of an equation over the time, with its band, and the variable that it follows.

The terms of the equation (`equation_terms`) and a process over the time, which is not tied to any
variable, are estimated together with the values of the rig from the linearised simulator
(`model.smoothing`). What a term cannot express, the process can.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray
from ...base.parallel import run_together
from ..model.hats import Hats, hats
from ..model.law import Law
from ..model.problem import Problem
from ..model.smoothing import Part, ornstein_uhlenbeck, smooth
from ..model.spectrum import BANDS
from ..result import UnknownInput
from .equation_terms import LINEAR, TABLES, EquationTerms
from .menu import KNOTS, KNOTS_OF_TIME, knots
from .trajectory import trajectories

# Corner frequencies of the process that are tried, Hz.
CORNERS_HZ = (1.0, 5.0, 25.0)
# Size of the process where the search for it begins, as a share of that of a term.
FIRST_SIZE = 0.1
# Frequencies of the errors that count, as a multiple of the highest one that hats can follow.
TIMES_HATS = 2
# A variable that explains less by this share is as good; the first one in the order of the terms,
# those that a table can have before rates, is taken.
AS_GOOD = 0.05


def unknown_input(terms: EquationTerms) -> UnknownInput:
    """Estimates the unknown input of an equation beside the rig without effects."""
    problem, x = terms.problem, terms.x
    of_records = [hats(record) for record in problem.records]
    here = trajectories(problem, x)
    parts, least, group, information, now = _linearised(terms, of_records, here)
    tasks = []
    for corner_hz in CORNERS_HZ:
        of_corner = [
            replace(part, correlation=ornstein_uhlenbeck(own.count, own.spacing_s, corner_hz))
            for part, own in zip(parts, of_records, strict=True)
        ]
        size = FIRST_SIZE * terms.scale
        tasks.append(partial(smooth, of_corner, least, group, size, information))
    tried = run_together(tasks)
    best = max(tried, key=lambda each: each.evidence)
    values = [law + mean for law, mean in zip(now, best.means, strict=True)]
    at = {
        variable: np.concatenate(
            [
                own.at_nodes(each[variable]).ravel()
                for own, each in zip(of_records, here, strict=True)
            ]
        )
        for variable in (*TABLES[terms.equation], *LINEAR[terms.equation])
        if variable in here[0]
    }
    value = np.concatenate([each.ravel() for each in values])
    deviation = np.concatenate([each.ravel() for each in best.deviations])
    follows, explained = followed(at, value, deviation)
    return UnknownInput(
        adds_to=terms.equation,
        record=np.repeat(np.arange(len(values)), [each.size for each in values]),
        window=np.concatenate([np.repeat(np.arange(len(each)), each.shape[1]) for each in values]),
        time_s=np.concatenate(
            [
                own.at_nodes(each["time_s"]).ravel()
                for own, each in zip(of_records, here, strict=True)
            ]
        ),
        value=value,
        deviation=deviation,
        of=follows,
        at=at[follows],
        explained=explained,
    )


@dataclass(frozen=True, eq=False)
class _Rows:
    """The first coefficients of the errors of all outputs: their bands and tolerated powers."""

    kept: int
    group: npt.NDArray[np.int64]
    least: FloatArray


def _rows(problem: Problem, kept: int) -> _Rows:
    band = np.array([k.bit_length() for k in range(kept)])
    least = [problem.likelihoods[name].tolerated[band] for name in problem.outputs]
    group = [band + BANDS * place for place, _ in enumerate(problem.outputs)]
    return _Rows(kept, np.concatenate(group), np.concatenate(least))


def _linearised(
    terms: EquationTerms, of_records: Sequence[Hats], here: Sequence[Mapping[str, FloatArray]]
) -> tuple[list[Part], FloatArray, npt.NDArray[np.int64], FloatArray, list[FloatArray]]:
    """Parts for the smoother, its other arguments, and the terms at the nodes as they are now."""
    problem, x = terms.problem, terms.x
    linear = problem.linear(x)
    most = max(own.count for own in of_records)
    signals = []
    for own in of_records:
        # All records have as many directions: one with fewer hats fills up.
        more = np.zeros((2 * (most - own.count), own.samples))
        signals.append([(terms.equation, row) for row in np.vstack([own.signals(), more])])
    responses = problem.responses(x, signals)
    free = problem.high > problem.low
    offset = (problem.centres() - x)[free]
    spectrum, outputs = problem.spectrum, problem.outputs
    errors = [spectrum.in_windows(linear.errors[name]) for name in outputs]
    slopes = [spectrum.in_windows(linear.slopes[name][:, free]) for name in outputs]
    inputs = [spectrum.in_windows(responses[name]) for name in outputs]
    rows = _rows(problem, min(TIMES_HATS * most, *(each.shape[1] for each in errors[0])))
    parts, now = [], []
    for place, own in enumerate(of_records):
        e, s, g = (_leading(each, place, rows.kept) for each in (errors, slopes, inputs))
        at_nodes, known = _terms_at_nodes(problem, x, own, here[place])
        # The parameters of the smoother are changes from the centres of their priors.
        known = known[:, :, free]
        now.append(at_nodes + known @ offset)
        parts.append(Part(e + s @ offset, own.own(g), s, known, np.eye(own.count)))
    return parts, rows.least, rows.group, problem.information()[free], now


def _leading(by_output: Sequence[Sequence[FloatArray]], place: int, kept: int) -> FloatArray:
    """The kept coefficients of the windows of a record, output after output, (W, R, ...)."""
    return np.concatenate([each[place][:, :kept] for each in by_output], axis=1)


def _terms_at_nodes(
    problem: Problem, x: FloatArray, own: Hats, here: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Sum of the laws of a problem at the nodes, (W, n), and its derivatives by x, (W, n, p)."""
    known = np.zeros((own.begins.size, own.count, x.size))
    first = x.size - sum(law.knots.size for law in problem.laws)
    for law in problem.laws:
        end = first + law.knots.size
        known[:, :, first:end] = own.at_nodes(_basis(law, here[law.of]))
        first = end
    return known @ x, known


def _basis(law: Law, variable: FloatArray) -> FloatArray:
    """Derivatives of a law along a trajectory by its parameters, shape (N, K)."""
    return np.stack([np.interp(variable, law.knots, row) for row in law.basis.T], axis=1)


def followed(
    at: Mapping[str, FloatArray], value: FloatArray, deviation: FloatArray
) -> tuple[str, float]:
    """The variable of which the input is most nearly a smooth function, and its share of it.

    Parameters
    ----------
    at
        each variable at the nodes, shape (M,).
    value, deviation
        the input there and its standard deviation, shape (M,).
    """
    weight = 1.0 / np.maximum(deviation, 1e-3 * deviation.max()) ** 2
    whole = float(np.sum(weight * (value - np.average(value, weights=weight)) ** 2))
    size = float(np.sqrt(np.average(value**2, weights=weight)))
    shares = {}
    for name, variable in at.items():
        places = knots(
            variable, KNOTS_OF_TIME if name == "time_s" else KNOTS, bends=name != "time_s"
        )
        if places is None or whole <= 0.0:
            continue
        basis = _basis(Law("", name, places, size), variable)
        rows = basis * weight[:, np.newaxis]
        z = np.linalg.solve(basis.T @ rows + np.eye(places.size), rows.T @ value)
        shares[name] = 1.0 - float(np.sum(weight * (value - basis @ z) ** 2)) / whole
    if not shares:
        return next(iter(at)), 0.0
    largest = max(shares.values())
    best = next(name for name, share in shares.items() if share > largest - AS_GOOD)
    return best, min(max(shares[best], 0.0), 1.0)
