# SPDX-License-Identifier: MIT
"""Fits of candidates: the calibration alone or with effects, each with the same budget.

Effects that have one name where only the cause matters, and laws that contain another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...base.parallel import run_together
from ...catalogue.parameters import effects as catalogue
from ...catalogue.spellings import ParameterKey, effect_values, sizes_of
from ...rigs.rig import TableLaw
from ..model.case import Case
from ..model.fit import BEHIND_NATS, ITERATIONS, Fit, best_of, descent, fit
from ..model.linear import Linear
from ..model.parameters import Law, effect_parameters
from ..model.problem import Problem
from ..model.scale import effect_starts, machine_scale, scan_starts
from .gap_reduction import WindowSums, window_sums
from .spool import SLEW, UNLIMITED_1_S, with_limit_of, with_slower_spool
from .stiffness import stiffness_starts

# Window lengths of the first fits from a cold start; all measured states are reset at the start of
# each window. Within a window, a limit cycle of 10 to 80 Hz must not slip by half a period, or the
# fit settles on a wrong multiple of its frequency.
COLD_WINDOWS_S = (0.03, 0.1, 0.25)
# A window with fewer samples shows little but its own start. At a slow sampling only the long
# windows are left, or none: a limit cycle that would slip cannot be seen there.
LEAST_COLD_SAMPLES = 6
# Integration steps per sample where candidates are compared. With four, the phase of an oil spring
# of 70 Hz stays within 6 degrees over a window.
DECISION_SUBSTEPS = 4
# A cold fit needs few iterations in each of its short windows, because fits with longer windows
# follow. A screening fit only shows which candidates are worth a long fit.
ITERATIONS_COLD = 6
ITERATIONS_SCREEN = 4
ITERATIONS_FINE = 4

# Of all starts of a short fit, so many go on after the first step. In 217 short fits of six
# development records the best start was behind these after one step twice, and then at the end by
# at most 3 nats.
STARTS_KEPT = 2


@dataclass(frozen=True, eq=False)
class FittedCandidate:
    """Candidate explanation of the records: the calibrated rig with a set of effects."""

    effects: tuple[str, ...]
    """Ids of the effects; none for the calibration alone."""
    x: FloatArray
    """Fitted parameters, shape (n,), in the order of `Case.parameters(effects)`, then those of the
    laws."""
    values: Mapping[str, float]
    """The same as values of the plant, by full name, without those of the laws."""
    cost: float
    """Cost on the training records, prior included, nats."""
    held_out_cost: float
    """Cost on the held-out records, without the prior, nats."""
    converged: bool
    """Whether the fit converged within its iterations."""
    squares: FloatArray
    counts: FloatArray
    """Held-out errors by window: sums of squares, shape (W, outputs), and numbers of samples, shape
    (W,). The mean of each window is subtracted from the errors of the position."""
    powers: FloatArray
    fit_powers: FloatArray
    """Sums of squared coefficients by window, output and band, shape (W, outputs, BANDS), of the
    held-out and of the training records; see `model.spectrum`."""
    sums: WindowSums
    """Sums over the held-out windows from which the gap follows as the contract defines it."""
    laws: tuple[Law, ...] = ()
    """Laws without a name that were fitted with the effects."""

    def tables(self) -> dict[str, TableLaw]:
        """The fitted laws as tables of a rig file, by name."""
        tables, first = {}, self.x.size - sum(law.knots.size for law in self.laws)
        for law in self.laws:
            end = first + law.knots.size
            tables[law.name] = law.table(self.x[first:end])
            first = end
        return tables


def evaluate(
    case: Case, effects: tuple[str, ...], fitted: Fit, laws: Sequence[Law] = ()
) -> FittedCandidate:
    """Returns a fit of effects and laws with its costs and errors on all data."""
    held_out = case.problem(effects, held_out=True, laws=laws)
    named = case.parameters(effects)
    values = {p.name: p.value(float(x)) for p, x in zip(named, fitted.x, strict=False)}
    simulated = held_out.simulate(fitted.x)
    errors = held_out.errors_of(simulated)
    squares, counts = held_out.window_squares(errors)
    coefficients = held_out.coefficients_of(simulated)
    training = case.problem(effects, laws=laws)
    return FittedCandidate(
        effects,
        fitted.x,
        values,
        fitted.cost,
        held_out.fit_cost(coefficients),
        fitted.converged,
        squares,
        counts,
        held_out.window_powers(coefficients),
        training.window_powers(training.coefficients(fitted.x)),
        window_sums(held_out.records, simulated, case.outputs),
        tuple(laws),
    )


def _best(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=lambda fitted: fitted.cost)


def decision_case(case: Case) -> Case:
    """Returns the case with the finer integration steps that decisions are based on."""
    if case.engine is not None:  # it has its own steps
        return case
    return replace(case, substeps=max(case.substeps, DECISION_SUBSTEPS))


def nominal_candidate(case: Case) -> FittedCandidate:
    """Returns the rig as configured, without any fit, with nuisances at their typical values."""
    problem = decision_case(case).problem()
    x = problem.centre()
    return evaluate(decision_case(case), (), Fit(x, problem.cost(x), 0, True))


def calibrate(case: Case, starts: Sequence[FloatArray] = ()) -> FittedCandidate:
    """Fits the rig without effects, from its priors and from any other starts.

    From the priors it starts directly, and also after fits in short windows: in windows of half a
    second a cold start can settle on a wrong multiple of the frequency of a limit cycle, in short
    windows it cannot. Where the sampling is slow, it starts from several stiffnesses of the oil.
    """
    problem = case.problem()
    if case.engine is not None:  # its state cannot be set in short windows
        return refine(case, (), problem.centre())
    slow = stiffness_starts(problem, problem.centre()) if _is_slow(case) else []
    fits = [
        partial(_fit_in_short_windows_first, case, _cold_windows_s(case)),
        *(
            partial(fit, problem, start, iterations=ITERATIONS)
            for start in (problem.centre(), *slow, *starts)
        ),
    ]
    best = _best(run_together(fits))
    limited = with_slower_spool(problem, case.problem(held_out=True), best, ITERATIONS)
    return again_with_other_stiffness(case, refine(case, (), limited.x))


def _cold_windows_s(case: Case) -> list[float]:
    """Lengths of the windows of the first fits that the sampling allows, s."""
    dt_s = max(record.dt_s or 0.0 for record in case.records)
    return [window_s for window_s in COLD_WINDOWS_S if window_s >= LEAST_COLD_SAMPLES * dt_s]


def _is_slow(case: Case) -> bool:
    """Whether the sampling may not follow the oil spring."""
    return case.engine is None and len(_cold_windows_s(case)) < len(COLD_WINDOWS_S)


def _fit_in_short_windows_first(case: Case, windows_s: Sequence[float]) -> Fit:
    """Fits the calibration from the priors in ever longer windows, then in those of the case."""
    problem = case.problem()
    x = problem.centre()
    for window_s in windows_s:
        short_problem = case.problem(window_s=window_s, all_states=True, white=True)
        x = fit(short_problem, x, iterations=ITERATIONS_COLD).x
    return fit(problem, x, iterations=ITERATIONS)


@dataclass(frozen=True, eq=False)
class FitStart:
    """Values from which a fit starts, shape (n,), with the sensitivities of the errors there."""

    x: FloatArray
    linear: Linear


def linearised_start(
    case: Case, effects: tuple[str, ...], x: FloatArray, laws: Sequence[Law] = ()
) -> FitStart:
    """Returns the values x of a candidate as a start, with the sensitivities there."""
    linear = case.problem(effects, laws=laws).linear(x)
    for name in case.outputs:
        linear.gram(name)  # once, not in each of the tasks that start here
    return FitStart(x, linear)


def places_and_sizes(
    case: Case, problem: Problem, effect: str, starts: Sequence[Mapping[str, float]]
) -> tuple[npt.NDArray[np.int64], list[FloatArray]]:
    """Places in x of the last effect of a problem, (n,), and the sizes of its starts there, (n,).

    The parameters of laws stand behind those of the effects.
    """
    sizes = [
        np.array([x for _, x in effect_parameters(effect, start, case.rig.plant)])
        for start in starts
    ]
    end = problem.low.size - sum(law.knots.size for law in problem.laws)
    return np.arange(end - sizes[0].size, end), sizes


def screen(
    case: Case,
    effects: tuple[str, ...],
    fit_starts: Sequence[FitStart],
    laws: Sequence[Law] = (),
) -> FittedCandidate:
    """Makes short fits from each start and size of the last effect; returns the best.

    fit_starts: values of the calibration, of all effects but the last, and of the laws. A
    calibration without the effect may have moved by many deviations to hide it, so that the values
    in the rig file are a start of their own.
    """
    problem = case.problem(effects, laws=laws)
    starts = scan_starts(effects[-1], case.rig) or effect_starts(effects[-1], case.rig)
    places, sizes = places_and_sizes(case, problem, effects[-1], starts)
    # A fit takes the sensitivities of the parameters in front of the effect.
    shared = [each.linear.leading(places[0]) if laws else each.linear for each in fit_starts]
    descents = [
        descent(problem, np.insert(start.x, places[0], size), linear)
        for size in sizes
        for start, linear in zip(fit_starts, shared, strict=True)
    ]
    short = best_of(descents, iterations=ITERATIONS_SCREEN, kept=STARTS_KEPT)
    return evaluate(case, effects, short, laws)


def grown_from(case: Case, simpler: FittedCandidate, effects: tuple[str, ...]) -> FittedCandidate:
    """Makes a short fit of a set of which a simpler law was fitted.

    The minimum of the cost is much narrower than that of the simpler law, and near it.

    effects: those of `simpler`, with one law in place of the simpler one that it contains.
    """
    problem = case.problem(effects)
    (effect,) = set(effects) - set(simpler.effects)
    contained = catalogue()[effect].contains
    assert contained is not None
    names = [parameter.name for parameter in problem.parameters]
    starts = []
    for sizes in catalogue()[effect].grown(
        sizes_of(contained, simpler.values), machine_scale(case.rig)
    ):
        values = {**simpler.values, **effect_values(effect, sizes)}
        starts.append(np.array([p.place(values[p.name]) for p in problem.parameters]))
    # All starts share the sensitivities of the rig and of the effects before the law.
    own = next(i for i, name in enumerate(names) if ParameterKey(name).effect == effect)
    shared = problem.linear(starts[0]).leading(own)
    descents = [descent(problem, x, shared) for x in starts]
    return evaluate(
        case, effects, best_of(descents, iterations=ITERATIONS_SCREEN, kept=STARTS_KEPT)
    )


def refine(case: Case, effects: tuple[str, ...], start: FloatArray) -> FittedCandidate:
    """Makes the long fit, which ends with the integration steps that decisions are based on."""
    coarse = fit(case.problem(effects), start, iterations=ITERATIONS)
    fine = decision_case(case)
    if fine.substeps == case.substeps:
        return evaluate(case, effects, coarse)
    return evaluate(fine, effects, fit(fine.problem(effects), coarse.x, iterations=ITERATIONS_FINE))


def refine_finely(case: Case, effects: tuple[str, ...], start: FloatArray) -> FittedCandidate:
    """Makes a fit with the integration steps of the decision only; its cost only falls."""
    fine = decision_case(case)
    return evaluate(fine, effects, fit(fine.problem(effects), start, iterations=ITERATIONS))


def again_with_other_stiffness(case: Case, candidate: FittedCandidate) -> FittedCandidate:
    """Fits a candidate from other stiffnesses of the oil, where the sampling is slow.

    The fit that it started from may have settled on a wrong one, because its effects were missing
    there. The starts have the values that were found, or those of the rig file, and the sizes that
    were found. Returns the candidate as it is where no other stiffness is better.
    """
    if not _is_slow(case):
        return candidate
    problem, effects = case.problem(candidate.effects), candidate.effects
    rig_size = case.problem().low.size
    while True:
        filed = np.append(problem.centre()[:rig_size], candidate.x[rig_size:])
        starts = [
            start for about in (candidate.x, filed) for start in stiffness_starts(problem, about)
        ]
        fits = [fit(problem, start, iterations=ITERATIONS) for start in starts]
        if not fits or _best(fits).cost > problem.cost(candidate.x) - BEHIND_NATS:
            return candidate
        other = refine(case, effects, _best(fits).x)
        if other.cost > candidate.cost - BEHIND_NATS:
            return candidate
        candidate = other


def again_with_slower_spool(case: Case, candidate: FittedCandidate) -> FittedCandidate:
    """Fits a candidate with a limited speed of the spool; returns it as it is if that is no better.

    An effect that was not in the fit of the calibration may have hidden the limit there.
    """
    if candidate.values.get(SLEW, 0.0) < UNLIMITED_1_S:
        return candidate
    effects = candidate.effects
    start = Fit(candidate.x, case.problem(effects).cost(candidate.x), 0, True)
    problem, held_out = case.problem(effects), case.problem(effects, held_out=True)
    limited = with_slower_spool(problem, held_out, start, ITERATIONS)
    if limited is start:
        return candidate
    fine = decision_case(case)
    # The fitted data alone may not show the limit.
    held = with_limit_of(fine.problem(effects), limited.x)
    found = evaluate(fine, effects, fit(held, limited.x, iterations=ITERATIONS))

    def all_costs(each: FittedCandidate) -> float:
        return each.cost + each.held_out_cost

    return found if all_costs(found) < all_costs(candidate) - BEHIND_NATS else candidate
