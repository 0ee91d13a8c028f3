# SPDX-License-Identifier: MIT
"""Evidence by which a record separates candidates after each of them is fitted to it.

Evidence of a linearised fit whose terms get the sizes that the records ask for.

The errors are linear in the changes t of the parameters about a point. Blocks of parameters, each
the values of one term, have a prior of unknown size; that of the largest evidence switches needless
terms off (automatic relevance determination: D. J. C. MacKay, Neural Computation 4(3), 1992). The
likelihood is that of `likelihood`, with the expected squares of the errors in place of the squares:

    ln Z >= -sum_b (n_b / 2) ln(E[P_b] + t_b) - KL(posterior of t | prior of t)

the variational bound, whose maximum over the posterior is reached in a few rounds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import norm

from ...base.numbers import FloatArray
from ...catalogue.parameters import effects as catalogue
from ...catalogue.spellings import sizes_of
from ...records import Record
from ...rigs import Rig
from ...signals.simulation import simulate
from ..deciding import EVIDENCE
from .comparison import Compared, compare
from .fit import SUBSTEPS, fit, step_inside
from .linear import Linear
from .parameters import Parameter, calibration_parameters, effect_parameters
from .problem import Problem
from .spectrum import OutputLikelihood

# Evidence for a name: odds of 150 to 1. A set is named in full where the odds are below ten to one,
# so that half of this evidence would do.
SEPARATED_NATS = 5.0
# The best candidate must explain its own record: its errors of integration must stay below a
# hundredth of the motion, or below the noise.
DESIGN_ERROR = 0.01
# Steps of a fit to its end: one that stops early leaves errors that look like a separation.
LAST_ITERATIONS = 40

# A candidate: its effects, and its values of the plant by full name.
CandidateModel = tuple[tuple[str, ...], Mapping[str, float]]


@dataclass(frozen=True)
class Separation:
    """Separation of a candidate from the best candidate by a record."""

    nats: float
    """Evidence by which the candidate, fitted to the record, is below the best candidate."""
    deviation: float
    """Its standard deviation, nats, by the scatter over the windows and by the noise."""

    @property
    def power(self) -> float:
        """Probability that the evidence exceeds SEPARATED_NATS.

        P = Phi((nats - SEPARATED_NATS) / deviation), because a mean over windows is nearly normal.
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
    iterations: int = LAST_ITERATIONS,
) -> list[Separation]:
    """Computes the evidence by which a record separates each candidate from the best one.

    All candidates are fitted to the record. With the powers P_b of the errors in band b, the
    tolerated powers t_b and the numbers n_b of independent coefficients, see `likelihood`, the
    evidence is that of the decision:

        nats = EVIDENCE sum_b (n_b / 2) ln((P_b(other) + t_b) / (P_b(best) + t_b)) / sum_b n_b

    over all outputs. The record is a simulation without noise; t_b includes the power of noise.
    The variance of `nats` is that of its mean over the windows, with the logarithm linearised, and
    that of the products of errors and noise: such a product has the mean square P_b t_b at most.

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
    of_best = _fitted(rig, best, compared, floors, iterations)
    results = []
    for other in candidates[1:]:
        if contains(other[0], best[0]):
            replayed = compare(_replayed(rig, other, record))
            pair = [
                _fitted(rig, candidate, replayed, floors, iterations) for candidate in (other, best)
            ]
            results.append(_separation(replayed, floors, *pair))
        else:
            fitted = _fitted(rig, other, compared, floors, iterations)
            results.append(_separation(compared, floors, of_best, fitted))
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


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A candidate after its fit to a record."""

    likelihoods: Mapping[str, OutputLikelihood]
    """Likelihood by output."""
    rms: Mapping[str, float]
    """Root mean square error by output, in the unit of the output."""
    powers: FloatArray
    """Mean squared coefficients by window, output and band, shape (W, outputs, BANDS)."""


def _fitted(
    rig: Rig,
    candidate: CandidateModel,
    compared: Compared,
    floors: Mapping[str, float],
    iterations: int,
) -> _Fitted:
    """Fits a candidate from its values."""
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
    simulated = problem.simulate(fit(problem, x, iterations=iterations).x)
    sums = problem.window_powers(problem.coefficients_of(simulated))
    in_window = np.maximum(problem.spectrum.sizes / problem.spectrum.windows, 1.0)
    errors = problem.errors_of(simulated)
    return _Fitted(
        problem.likelihoods, {name: _rms(errors[name]) for name in errors}, sums / in_window
    )


def _separation(
    compared: Compared, floors: Mapping[str, float], best: _Fitted, other: _Fitted
) -> Separation:
    if any(
        best.rms[name] > _largest_acceptable_error(compared, name, floor)
        for name, floor in floors.items()
    ):
        # The integration steps of the fits are too long for this record. It has no information.
        return Separation(0.0, 0.0)
    windows = best.powers.shape[0]
    likelihoods = best.likelihoods.values()
    scale = EVIDENCE / sum(float(likelihood.counts.sum()) for likelihood in likelihoods)
    nats, by_window, noise = 0.0, np.zeros(windows), 0.0
    for place, likelihood in enumerate(likelihoods):
        half, tolerated = 0.5 * scale * likelihood.counts, likelihood.tolerated
        for fitted, sign in ((other, 1.0), (best, -1.0)):
            powers = fitted.powers[:, place]
            mean = powers.mean(axis=0)
            total = mean + tolerated
            nats += sign * float(half @ np.log(total))
            # d (n / 2) ln(P + t) = (n / 2) dP / (P + t)
            by_window += sign * powers @ (half / total)
            # P changes by 2 mean(c e), of variance 4 P t / R, with noise e and R coefficients c.
            variance = 4.0 * mean * tolerated / np.maximum(likelihood.spectrum.sizes, 1.0)
            noise += float((half / total) ** 2 @ variance)
    scatter = float(np.var(by_window, ddof=1)) / windows if windows > 1 else 0.0
    return Separation(nats, float(np.sqrt(scatter + noise)))


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _largest_acceptable_error(compared: Compared, name: str, floor: float) -> float:
    """Largest acceptable rms error of the best candidate on its own record, unit of the output."""
    spread = _rms(compared.centred(compared.outputs[name]))
    return max(floor, DESIGN_ERROR * spread)


# Steps of the linear refit, whose weights follow the errors, and its ridge.
LINEAR_STEPS, RIDGE = 8, 1e-9
ROUNDS = 15
# Range of the factor of the prior variance of a block.
FACTORS = (1e-8, 1e4)


@dataclass(frozen=True, eq=False)
class Relevance:
    """Evidence, nats, and the factor by which each block's prior variance became larger."""

    evidence: float
    factors: FloatArray


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Squares of the errors of B bands of outputs as a function of n parameters."""

    squares: FloatArray
    products: FloatArray
    grams: FloatArray
    """Sum of squares, (B,), its half gradient, (B, n), and half Hessian, (B, n, n)."""
    rows: FloatArray
    independent: FloatArray
    tolerated: FloatArray
    """Number of coefficients, of independent ones, and tolerated power, shape (B,) each."""

    def power_after(self, change: FloatArray) -> FloatArray:
        """Mean square of the errors in each band behind a change of the parameters, shape (B,)."""
        squares = self.squares + 2.0 * self.products @ change
        squares += np.einsum("i,bij,j->b", change, self.grams, change, optimize=True)
        return np.maximum(squares, 0.0) / self.rows


def reweighted(
    errors: Quadratic,
    information: FloatArray,
    offset: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Power in each band, (B,), behind the change of the parameters that is best, and that change.

    The weights follow the errors (P. Green, J. R. Stat. Soc. B 46(2), 1984).

    Parameters
    ----------
    errors
        squares of the errors as a function of the n changes.
    information, offset
        inverse variances of the priors, and how far from their means the parameters are, (n,).
    low, high
        bounds of the changes, (n,).
    """
    power, change = errors.squares / errors.rows, np.zeros_like(offset)
    for _ in range(LINEAR_STEPS):
        weights = errors.independent / (errors.rows * (power + errors.tolerated))
        hessian = np.tensordot(weights, errors.grams, axes=1) + np.diag(information)
        hessian += RIDGE * np.diag(np.diag(hessian) + 1e-300)
        gradient = weights @ errors.products + information * offset
        change = step_inside(gradient, hessian, low, high, high > low)
        power = errors.power_after(change)
    return power, change


def quadratic(problem: Problem, linear: Linear) -> Quadratic:
    """The squares of the errors of a problem, linearised; `linear` may have parameters more."""
    columns: list[tuple[float, FloatArray, FloatArray, float, float, float]] = []
    for name in problem.outputs:
        likelihood, errors = problem.likelihoods[name], linear.errors[name]
        slopes, grams = linear.slopes[name], linear.gram(name)
        for band, slices in enumerate(problem.spectrum.bands):
            if likelihood.counts[band] > 0.0:
                columns.append(
                    (
                        sum(float(errors[rows] @ errors[rows]) for rows in slices),
                        np.sum([slopes[rows].T @ errors[rows] for rows in slices], axis=0),
                        grams[band],
                        float(problem.spectrum.sizes[band]),
                        float(likelihood.counts[band]),
                        float(likelihood.tolerated[band]),
                    )
                )
    return Quadratic(*(np.array(column) for column in zip(*columns, strict=True)))


def relevance(
    errors: Quadratic,
    offset: FloatArray,
    information: FloatArray,
    blocks: Sequence[npt.NDArray[np.int64]],
) -> Relevance:
    """Evidence with the best sizes of the blocks.

    Parameters
    ----------
    errors
        squares of the errors as a function of the changes of the parameters.
    offset, information
        mean and inverse variance of the prior of these changes, shape (n,) each.
    blocks
        indices of the parameters of each block.
    """
    factors = np.ones(len(blocks))
    power = errors.squares / errors.rows
    best = Relevance(-np.inf, factors)
    for _ in range(ROUNDS):
        weights = errors.independent / (errors.rows * (power + errors.tolerated))
        prior = information.copy()
        for block, factor in zip(blocks, factors, strict=True):
            prior[block] /= factor
        precision = np.tensordot(weights, errors.grams, axes=1) + np.diag(prior)
        covariance = np.asarray(np.linalg.inv(precision), dtype=np.float64)
        change = covariance @ (prior * offset - weights @ errors.products)
        moved = change - offset
        divergence = 0.5 * float(
            moved @ (prior * moved)
            + prior @ np.diag(covariance)
            + np.linalg.slogdet(precision)[1]
            - np.sum(np.log(prior))
            - change.size
        )
        power = (
            errors.squares
            + 2.0 * errors.products @ change
            + np.einsum("i,bij,j->b", change, errors.grams, change, optimize=True)
            + np.einsum("bij,ij->b", errors.grams, covariance)
        ) / errors.rows
        power = np.maximum(power, 0.0)
        cost = 0.5 * float(np.sum(errors.independent * np.log(power + errors.tolerated)))
        if -cost - divergence > best.evidence:
            best = Relevance(-cost - divergence, factors)
        factors = np.array(
            [
                _factor(information[block], moved[block], covariance[block, block], factor)
                for block, factor in zip(blocks, factors, strict=True)
            ]
        )
    return best


def _factor(
    information: FloatArray, moved: FloatArray, variance: FloatArray, factor: float
) -> float:
    """Next factor of a block: squares of its changes over the number that the records determine."""
    determined = moved.size - float(information @ variance) / factor
    squares = float(information @ moved**2)
    return float(np.clip(squares / max(determined, 1e-3), *FACTORS))
