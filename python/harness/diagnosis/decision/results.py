# SPDX-License-Identifier: MIT
"""Results of the diagnosis: simulated records, gap, estimates with intervals, probabilities.

Sentences on what a reader of the verdict would otherwise take for a contradiction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from msgspec.structs import replace

from ...base.numbers import FloatArray
from ...catalogue.spellings import ParameterKey, sizes_of
from ..deciding import FIT_TOGETHER, MOVED_FIT, MOVED_PRIOR
from ..model.case import Case
from ..model.comparison import Compared
from ..model.parameters import Parameter
from ..result import HeldOutRun
from ..schema import Calibrated, Candidate, Effect, Estimate, HowFar, Value
from ..search.candidates import FittedCandidate, decision_case
from ..search.gap_reduction import (
    explained_share,
    gap_reduction,
    reduction_between_machines,
    window_sums,
)
from ..search.intervals import (
    candidate_deviations,
    in_deviations,
    interval,
    likelihood_gain,
    size_between_machines,
    values_at_bounds,
)
from ..search.model_error import model_error
from ..search.search import SearchResult
from .effect_selection import Selection, chance, in_words, percent, standing


def held_out_results(
    case: Case, nominal: FittedCandidate, calibrated: FittedCandidate, best: FittedCandidate
) -> tuple[tuple[HeldOutRun, ...], HowFar]:
    """Returns the held-out records with their three simulations, and the reduction of the gap."""
    fine = decision_case(case)
    candidates = (nominal, calibrated, best)
    problems = [
        fine.problem(candidate.effects, held_out=True, laws=candidate.laws)
        for candidate in candidates
    ]
    simulations = [
        problem.simulate(candidate.x)
        for problem, candidate in zip(problems, candidates, strict=True)
    ]
    records = problems[0].records
    sums = [window_sums(records, simulated, case.outputs) for simulated in simulations]
    reduction = gap_reduction(sums[0], sums[1], sums[2], case.floors)
    if best.effects or best.laws:
        reduction = reduction_between_machines(reduction, case.pressures)
    runs = []
    for index, compared in enumerate(records):
        record = compared.record
        runs.append(
            HeldOutRun(
                record.name,
                _times(compared),
                compared.window,
                record.column("command_v"),
                {name: compared.outputs[name] for name in case.outputs},
                *(simulated[index] for simulated in simulations),
            )
        )
    return tuple(runs), replace(reduction, carries_over=_by_command(case, runs))


def _times(compared: Compared) -> FloatArray:
    time_s = compared.record.time_s
    counted_s = np.arange(compared.window.size, dtype=np.float64) * compared.dt_s
    return counted_s if time_s is None else time_s


def _by_command(case: Case, runs: Sequence[HeldOutRun]) -> tuple[float, float] | None:
    """Shares of the explainable gap that the effects remove at smaller and at larger commands.

    Windows are split at the median of their mean |command|. None with fewer than 8 windows, or
    where a half has no explainable gap.
    """
    rows = []
    for run in runs:
        numbers = run.window[run.window >= 0]
        inside = run.window >= 0
        samples = np.bincount(numbers)
        size = np.bincount(numbers, np.abs(run.command_v[inside])) / np.maximum(samples, 1)
        squares = [
            sum(
                np.bincount(numbers, (simulated[name] - run.measured[name])[inside] ** 2)
                / case.floors[name].value ** 2
                for name in case.outputs
            )
            for simulated in (run.calibrated, run.augmented)
        ]
        count = samples * len(case.outputs)
        sampled = count > 0
        rows.append(np.stack([size, *squares, count])[:, sampled])
    size, before, after, count = np.concatenate(rows, axis=1)
    if size.size < 8:
        return None
    large = size > np.median(size)
    shares = []
    for half in (~large, large):
        rms = [math.sqrt(part[half].sum() / count[half].sum()) for part in (before, after)]
        if rms[0] <= 1.0:
            return None
        shares.append((rms[0] - rms[1]) / (rms[0] - 1.0))
    return shares[0], shares[1]


def estimates(
    case: Case, candidate: FittedCandidate
) -> tuple[dict[str, Estimate], dict[str, bool]]:
    """Returns the estimates of all fitted values by full name, and whether each has moved.

    A moved value differs from the centre of its prior by MOVED_PRIOR deviations of the prior and
    MOVED_FIT of the fit.
    """
    deviations, windows = candidate_deviations(case, candidate)
    estimated, moved = {}, {}
    parameters = case.parameters(candidate.effects)
    # The parameters of laws come last; they are no values of the rig.
    for parameter, x, deviation in zip(parameters, candidate.x, deviations, strict=False):
        value = parameter.value(float(x))
        of_model = model_error(case, candidate.effects, parameter.name, value)
        estimated[parameter.name] = size_between_machines(
            interval(parameter, float(x), float(deviation), windows, of_model),
            parameter,
            case.pressures,
        )
        prior_deviations, fit_deviations = in_deviations(parameter, float(x), float(deviation))
        moved[parameter.name] = prior_deviations >= MOVED_PRIOR and fit_deviations >= MOVED_FIT
    return estimated, moved


def calibration_of(
    case: Case, estimated: Mapping[str, Estimate], moved: Mapping[str, bool]
) -> dict[str, Calibrated]:
    """Returns the calibrated values of the rig and the nuisances.

    A nuisance has no value in the rig file, so that it never counts as moved.
    """
    return {
        parameter.name: Calibrated(
            parameter.value(parameter.centre),
            estimated[parameter.name].value,
            estimated[parameter.name].ci90,
            moved[parameter.name] and not ParameterKey(parameter.name).is_nuisance,
        )
        for parameter in case.parameters()
    }


def in_sigmas(parameter: Parameter, estimate: Estimate) -> Estimate | None:
    """Returns an estimate in standard deviations of the parameter's prior, from its centre.

    None where the prior has no finite deviation.
    """
    if not (math.isfinite(parameter.sigma) and parameter.sigma > 0.0):
        return None
    value, low, high = (
        (parameter.place(end) - parameter.centre) / parameter.sigma if math.isfinite(end) else end
        for end in (estimate.value, estimate.low, estimate.high)
    )
    return Estimate(value, low, high)


def selected_effects(
    case: Case,
    search_result: SearchResult,
    selection: Selection,
    values: Mapping[str, Estimate],
    of_all: float = 1.0,
) -> tuple[Effect, ...]:
    """Returns the effects of the best set, most probable first, with shares of the held-out gain.

    Effects whose probabilities agree to a hundredth keep the order in which they were found.

    of_all: share of all these effects together; laws without a name may have the rest.
    """
    best = selection.best
    gains = {}
    for effect in best.effects:
        remaining = frozenset(best.effects) - {effect}
        without = next(
            (
                candidate
                for candidate in (search_result.calibrated, *search_result.refined)
                if frozenset(candidate.effects) == remaining
            ),
            search_result.calibrated,
        )
        gains[effect] = max(likelihood_gain(case, best, without).relative, 1e-6)
    total = sum(gains.values())
    effects = []
    for effect in best.effects:
        parameters = sizes_of(effect, values)
        effects.append(
            Effect(
                effect,
                selection.posterior.of_effect(effect),
                {name: Value.of(size) for name, size in parameters.items()},
                of_all * gains[effect] / total,
            )
        )
    return tuple(sorted(effects, key=lambda effect: -round(effect.probability, 2)))


def ranked_candidates(
    case: Case, search_result: SearchResult, selection: Selection
) -> tuple[Candidate, ...]:
    """Lists the calibrated rig and all sets that were fitted or screened, by held-out cost."""
    equivalent_sets = {candidate.effects for candidate in (selection.best, *selection.equivalent)}
    calibrated = search_result.calibrated
    fitted = search_result.fitted()
    candidates = []
    for candidate in fitted:
        keys = {ParameterKey(name): value for name, value in candidate.values.items()}
        hypothesis = selection.hypothesis(candidate)
        found = standing(case, search_result, selection, candidate)
        own_values = {key: value for key, value in keys.items() if key.effect in candidate.effects}
        candidates.append(
            Candidate(
                candidate.effects,
                max(likelihood_gain(case, fitted[0], candidate).nats, 0.0),
                explained_share(calibrated.sums, candidate.sums, case.floors, selection.best.sums)
                or 0.0,
                {f"{key.effect}.{key.parameter}": value for key, value in own_values.items()},
                candidate.effects in equivalent_sets,
                candidate.cost,
                candidate.held_out_cost,
                candidate.x.size,
                found.kind,
                found.why,
                *(
                    (
                        hypothesis.left,
                        hypothesis.small,
                        hypothesis.probability,
                        hypothesis.price.total,
                    )
                    if hypothesis is not None
                    else (None, None, None, None)
                ),
            )
        )
    return tuple(candidates)


# The fitted values are called worse than those of the rig file where the gap on held-out data is
# larger by a twentieth: the same tolerance by which sets of effects are told apart.
WORSE_CALIBRATED = 1.05
# One output is called worse where its gap is larger by half, and by more than the noise floor.
WORSE_OUTPUT = 1.5
# A set that is not named is spoken of where it would remove a quarter of the gap.
MUCH_REMOVED = 0.25


def caveats(
    case: Case, search_result: SearchResult, selection: Selection, reduction: HowFar
) -> tuple[str, ...]:
    """Returns the sentences that apply, in the order in which a reader meets the matter."""
    return (
        *_worse_calibration(selection.best, reduction),
        *_worse_outputs(reduction),
        *_cause_not_excluded(selection),
        *_unnamed_candidates(case, search_result, selection),
        *_values_at_bounds(case, selection.best),
    )


def _worse_calibration(best: FittedCandidate, reduction: HowFar) -> list[str]:
    """Says where the fitted values are worse than the rig file on data that were not fitted."""
    nominal, calibrated = reduction.nominal, reduction.calibrated
    if calibrated <= max(WORSE_CALIBRATED * nominal, reduction.noise_floor[1]):
        return []
    why = "the cause of the gap differs between these data, or the simulator lacks it"
    if best.effects:
        why = (
            f"without {in_words(best.effects)} the fit makes the values of the rig stand in for "
            f"{'it' if len(best.effects) == 1 else 'them'}, which holds for the fitted data only"
        )
    return [
        "The fitted values of the rig are worse than those of the rig file on held-out data: the "
        f"gap is {percent(calibrated)} in place of {percent(nominal)}. Values are fitted to some "
        f"data and judged by others; {why}."
    ]


def worse_outputs(reduction: HowFar) -> tuple[str, ...]:
    """Names of the outputs that the last simulation shows clearly worse than the rig as configured.

    Better values for some outputs at the cost of another one stand in for a cause that is missing.
    """
    return tuple(
        name
        for name, gaps in reduction.gaps.items()
        if gaps.augmented > WORSE_OUTPUT * gaps.nominal
        and gaps.augmented - gaps.nominal > reduction.noise_floor[1]
    )


def _worse_outputs(reduction: HowFar) -> list[str]:
    return [
        f"{name} gets worse: its gap on held-out data is {percent(gaps.augmented)} in place of "
        f"{percent(gaps.nominal)} with the simulator as configured. Do not use the found values "
        "where this output matters: they stand in for something else."
        for name, gaps in reduction.gaps.items()
        if name in worse_outputs(reduction)
    ]


def _cause_not_excluded(selection: Selection) -> list[str]:
    """Says where nothing is named although a cause outside of the catalogue is not improbable."""
    outside = selection.posterior.outside
    if selection.answer.kind != "healthy" or outside < FIT_TOGETHER:
        return []
    return [
        f"A cause outside of the catalogue is not excluded: its probability is {chance(outside)}. "
        "To blame a sound machine would cost more than to look further, so nothing is blamed."
    ]


def _unnamed_candidates(case: Case, search_result: SearchResult, selection: Selection) -> list[str]:
    """Says why the first candidate, or one that explains much while nothing is named, is not named.

    Equivalent sets are listed in the verdict itself.
    """
    best, calibrated = selection.best, search_result.calibrated
    fitted = search_result.fitted()
    first = fitted[0]
    in_set = any(first is candidate for candidate in (best, *selection.equivalent))
    sentences = []
    if first.effects and not in_set:
        why = standing(case, search_result, selection, first).why
        sentences.append(
            f"The set with the smallest errors on held-out data, {in_words(first.effects)}, is not "
            f"named: {why}."
        )
    if best.effects:
        return sentences
    for candidate in fitted:
        share = explained_share(calibrated.sums, candidate.sums, case.floors, best.sums)
        if candidate in (first, calibrated) or share is None or share < MUCH_REMOVED:
            continue
        why = standing(case, search_result, selection, candidate).why
        sentences.append(
            f"The set {in_words(candidate.effects)} would remove {100.0 * share:.0f} % of the gap "
            f"above the noise floor, but is not named: {why}."
        )
        break
    return sentences


def _values_at_bounds(case: Case, best: FittedCandidate) -> list[str]:
    """Says which fitted values of the rig or of an effect ended at an end of their range."""
    return [
        f"{one.told} of the range of this effect: a further cause may act in the same way."
        if one.key.effect in best.effects
        else f"{one.told} of what the uncertainty in the rig file allows: either give it a larger "
        "one under [uncertainty], or this value stands in for a cause that is not modelled."
        for one in values_at_bounds(case, best)
    ]
