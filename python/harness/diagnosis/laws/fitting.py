# SPDX-License-Identifier: MIT
"""Fits of laws without a name through the simulator, as any effect is fitted.

The unknown input of an equation over the time, with its band, and the variable that it follows.

The terms of the equation (`equation_terms`) and a process over the time, which is not tied to any
variable, are estimated together with the values of the rig from the linearised simulator
(`model.smoothing`). What a term cannot express, the process can.

Shares of the equations in the gap, and what those with a large share lack over the time.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt
from msgspec.structs import replace as replace_struct

from ...base.numbers import FloatArray
from ...base.parallel import Progress, part_of, run_together
from ...catalogue.channels import TIME
from ..model.case import Case
from ..model.fit import Hats, descent, fit, hats
from ..model.linear import Linear
from ..model.parameters import Law
from ..model.problem import Problem
from ..model.smoothing import Part, ornstein_uhlenbeck, smooth
from ..model.spectrum import BANDS
from ..result import UnknownInput
from ..schema import SUBSYSTEM_TAKES_PART, Equation
from ..search.candidates import FittedCandidate, decision_case, evaluate
from ..search.score import left
from .equation_terms import LINEAR, SUBSYSTEM, TABLES, EquationTerms, equation_terms
from .forms import KNOTS, KNOTS_OF_TIME, is_linkage, knots, laws, trajectories

# Steps of a short fit of each law of the menu, number of laws that get a long one, and its steps.
SHORT, KEPT, LONG = 3, 4, 12
# Share of the time that the short fits take.
SHORT_FITS = 0.6


@dataclass(frozen=True, eq=False)
class FittedLaw:
    """A candidate with one law more; `left`: the errors that it leaves, see `evidence.left`."""

    candidate: FittedCandidate
    left: float

    @property
    def law(self) -> Law:
        """The law that was added last."""
        return self.candidate.laws[-1]


def with_one_law(
    case: Case,
    candidate: FittedCandidate,
    progress: Progress | None = None,
    *,
    over_time: bool = True,
) -> list[FittedLaw]:
    """Adds each law of the menu to a candidate; returns the best few, fitted, best first.

    Those of a linkage are among them. over_time: whether laws over the time are tried.
    """
    fine = decision_case(case)
    shared = fine.problem(candidate.effects, laws=candidate.laws).linear(candidate.x)
    present = {law.name for law in candidate.laws}
    menu = [
        law
        for law in laws(fine, candidate)
        if law.name not in present and (over_time or law.of != TIME)
    ]
    tasks = [partial(_short, fine, candidate, law, shared) for law in menu]
    short = run_together(tasks, part_of(progress, 0.0, SHORT_FITS))
    short.sort(key=lambda each: each.cost)
    longer = [
        partial(_long, fine, each)
        for place, each in enumerate(short)
        if place < KEPT or is_linkage(each.laws)
    ]
    fitted = run_together(longer, part_of(progress, SHORT_FITS, 1.0))
    return sorted((FittedLaw(each, left(fine, each)) for each in fitted), key=lambda e: e.left)


def with_law(case: Case, candidate: FittedCandidate, law: Law) -> FittedCandidate:
    """The long fit of a candidate with this law more."""
    shared = case.problem(candidate.effects, laws=candidate.laws).linear(candidate.x)
    return _long(case, _short(case, candidate, law, shared))


def _short(case: Case, candidate: FittedCandidate, law: Law, shared: Linear) -> FittedCandidate:
    """A few steps from the candidate with the law at zero."""
    laws = (*candidate.laws, law)
    problem = case.problem(candidate.effects, laws=laws)
    start = np.concatenate([candidate.x, np.zeros(law.knots.size)])
    *_, last = itertools.islice(descent(problem, start, shared), SHORT)
    return evaluate(case, candidate.effects, last, laws)


def _long(case: Case, short: FittedCandidate) -> FittedCandidate:
    """A long fit, and another one where the law is larger than its prior had expected."""
    problem = case.problem(short.effects, laws=short.laws)
    fitted = evaluate(case, short.effects, fit(problem, short.x, iterations=LONG), short.laws)
    *others, law = fitted.laws
    z = fitted.x[-law.knots.size :]
    # The size s of the prior is estimated, too (empirical Bayes): s^2 <- s^2 mean(z^2). A law that
    # is pulled towards zero pushes the values of the rig away from theirs.
    larger = float(np.sqrt(np.mean(z**2)))
    if larger < 1.0:
        return fitted
    laws = (*others, replace(law, size=larger * law.size))
    start = np.concatenate([fitted.x[: -law.knots.size], z / larger])
    problem = case.problem(short.effects, laws=laws)
    return evaluate(case, short.effects, fit(problem, start, iterations=LONG), laws)


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
        basis = _basis(law, here[law.of])
        if law.adds_to == "mass":  # F = m a + 1/2 m' v^2
            square = here["velocity_m_s"][:, np.newaxis] ** 2
            basis = basis * here["acceleration_m_s2"][:, np.newaxis]
            basis += 0.5 * square * _slopes(law, here[law.of])
        known[:, :, first:end] = own.at_nodes(basis)
        first = end
    return known @ x, known


def _basis(law: Law, variable: FloatArray) -> FloatArray:
    """Derivatives of a law along a trajectory by its parameters, shape (N, K)."""
    return np.stack([np.interp(variable, law.knots, row) for row in law.basis.T], axis=1)


def _slopes(law: Law, variable: FloatArray) -> FloatArray:
    """Derivatives of the slope of a law along a trajectory by its parameters, shape (N, K)."""
    slopes = np.diff(law.basis, axis=0) / np.diff(law.knots)[:, np.newaxis]
    between = np.searchsorted(law.knots, variable, side="right")
    inside = (between > 0) & (between < law.knots.size)
    here = slopes[np.clip(between - 1, 0, law.knots.size - 2)]
    return np.asarray(np.where(inside[:, np.newaxis], here, 0.0))


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


# Gain, nats, below which no equation lacks anything that the records show.
LEAST_GAIN = 3.0
# Gains that differ by this are in the proportion e. The errors of a model repeat, so that a nat of
# evidence is worth less than one: on 87 machines of development the shares with 25 gave the true
# part the highest mean logarithm.
NATS = 25.0
# Share of the time that the fits of the terms take; the unknown inputs take the rest.
TERMS = 0.9


def equation_shares(
    case: Case, calibrated: FittedCandidate, progress: Progress | None = None
) -> tuple[tuple[Equation, ...], tuple[UnknownInput, ...]]:
    """Returns the equations and what those with a large share lack over the time.

    The largest share is first; there are none where no term explains anything.

    A part of the machine counts by the largest gain of its equations, so that one with two
    equations is not preferred.
    """
    terms = equation_terms(case, calibrated, part_of(progress, 0.0, TERMS))
    shares = shares_of({each.equation: each.gain for each in terms})
    rows, lacking = [], []
    for each in sorted(terms, key=lambda each: -shares.get(each.equation, 0.0)):
        if each.equation not in shares:
            continue
        row = Equation(each.equation, SUBSYSTEM[each.equation], shares[each.equation], each.gain)
        if row.share >= SUBSYSTEM_TAKES_PART:
            lacks = unknown_input(each)
            lacking.append(lacks)
            row = replace_struct(row, of=lacks.of, explained=lacks.explained)
        rows.append(row)
    return tuple(rows), tuple(lacking)


def shares_of(gains: Mapping[str, float]) -> dict[str, float]:
    """Shares by equation, sum 1, from the gains in nats; empty where none is large enough."""
    largest = max(gains.values(), default=0.0)
    if not largest >= LEAST_GAIN:
        return {}
    weights = {name: math.exp((gain - largest) / NATS) for name, gain in gains.items()}
    subsystems: dict[str, list[float]] = {}
    for name, weight in weights.items():
        subsystems.setdefault(SUBSYSTEM[name], []).append(weight)
    total = sum(max(each) for each in subsystems.values())
    return {
        name: weight / total * _of_one(subsystems[SUBSYSTEM[name]])
        for name, weight in weights.items()
    }


def _of_one(weights: Sequence[float]) -> float:
    """Factor for which the weights add up to the largest of them."""
    return max(weights) / sum(weights)
