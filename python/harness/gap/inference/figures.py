# SPDX-License-Identifier: MIT
"""Figures of the diagnosis: simulated records, gap, values with intervals, probabilities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.keys import ParameterKey, sizes_of
from ehsid.harness.gap.inference.advantage import above_floor, advantage
from ehsid.harness.gap.inference.choice import Choice
from ehsid.harness.gap.inference.how_far import how_far, window_sums
from ehsid.harness.gap.inference.intervals import in_deviations, interval, scatter_of
from ehsid.harness.gap.inference.rivals import Rival, decisive
from ehsid.harness.gap.inference.search import Found
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.comparison import Compared
from ehsid.harness.gap.model.parameters import Parameter
from ehsid.harness.gap.schema import (
    CalibratedValue,
    Candidate,
    Estimate,
    FoundEffect,
    HeldOutRun,
    HowFar,
)
from ehsid.harness.gap.thresholds import (
    BOOTSTRAP_SEED,
    DOUBT,
    MODEL_ERROR,
    MODEL_ERROR_POSITION,
    MOVED_FIT,
    MOVED_TOLD,
    SURE,
    TEMPERATURE,
)


def held_out_figures(
    case: Case, nominal: Rival, calibrated: Rival, best: Rival
) -> tuple[tuple[HeldOutRun, ...], HowFar]:
    """Returns the held-out records with their three simulations, and the figures of the gap."""
    fine = decisive(case)
    rivals = (nominal, calibrated, best)
    problems = [fine.problem(one.effects, held_out=True) for one in rivals]
    shown = [problem.simulate(one.x) for problem, one in zip(problems, rivals, strict=True)]
    records = problems[0].records
    sums = [window_sums(records, one, case.outputs) for one in shown]
    far = how_far(sums[0], sums[1], sums[2], case.floors, np.random.default_rng(BOOTSTRAP_SEED))
    runs = []
    for place, compared in enumerate(records):
        record = compared.record
        runs.append(
            HeldOutRun(
                record.name,
                _times(compared),
                compared.window,
                record.column("command_v"),
                {name: compared.outputs[name] for name in case.outputs},
                *(one[place] for one in shown),
            )
        )
    return tuple(runs), replace(far, carries_over=_by_command(case, runs))


def _times(compared: Compared) -> FloatArray:
    told = compared.record.time_s
    counted = np.arange(compared.window.size, dtype=np.float64) * compared.dt_s
    return counted if told is None else told


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
        kept = count > 0
        rows.append(np.stack([size, *squares, count])[:, kept])
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


def estimates(case: Case, rival: Rival) -> tuple[dict[str, Estimate], dict[str, bool]]:
    """Returns the estimates of all fitted values by full name, and whether each has moved.

    A moved value is off the centre of its prior by MOVED_TOLD deviations of the prior and MOVED_FIT
    of the fit.
    """
    scatter, windows = scatter_of(case, rival)
    model_error = MODEL_ERROR if case.pressures else MODEL_ERROR_POSITION
    found, moved = {}, {}
    parameters = case.parameters(rival.effects)
    for parameter, x, deviation in zip(parameters, rival.x, scatter, strict=True):
        found[parameter.name] = interval(
            parameter, float(x), float(deviation), windows, model_error
        )
        told, fitted = in_deviations(parameter, float(x), float(deviation))
        moved[parameter.name] = told >= MOVED_TOLD and fitted >= MOVED_FIT
    return found, moved


def calibration_of(
    case: Case, found: Mapping[str, Estimate], moved: Mapping[str, bool]
) -> dict[str, CalibratedValue]:
    """Returns the calibrated values of the rig and the nuisances.

    A nuisance has no value in the rig file, so that it never counts as moved.
    """
    return {
        one.name: CalibratedValue(
            one.value(one.centre),
            found[one.name],
            moved[one.name] and not ParameterKey(one.name).is_nuisance,
            in_sigmas(one, found[one.name]),
        )
        for one in case.parameters()
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


def probabilities(case: Case, choice: Choice, far: HowFar) -> dict[str, float]:
    """Returns the probability that each effect of the best set is present.

    The best set and its equals have the weights exp(-nats / TEMPERATURE). Because another cause is
    always possible, the probability is at most SURE, and lower, the more of the gap is left.
    """
    floor = far.noise_floor[1]
    room = far.calibrated - floor
    left = min(max((far.augmented - floor) / room, 0.0), 1.0) if room > 0.0 else 0.0
    sure = SURE * (1.0 - DOUBT * left)
    rivals = (choice.best, *choice.equals)
    weights = [
        math.exp(-max(advantage(case, choice.best, one).nats, 0.0) / TEMPERATURE) for one in rivals
    ]
    total = sum(weights)
    return {
        effect: sure
        * sum(w for w, one in zip(weights, rivals, strict=True) if effect in one.effects)
        / total
        for effect in choice.best.effects
    }


def found_effects(
    case: Case, found: Found, choice: Choice, values: Mapping[str, Estimate], far: HowFar
) -> tuple[FoundEffect, ...]:
    """Returns the effects of the best set, each with its share of the held-out gain."""
    best = choice.best
    sure = probabilities(case, choice, far)
    gains = {}
    for effect in best.effects:
        rest = frozenset(best.effects) - {effect}
        without = next(
            (one for one in (found.calibrated, *found.rivals) if frozenset(one.effects) == rest),
            found.calibrated,
        )
        gains[effect] = max(advantage(case, best, without).relative, 1e-6)
    total = sum(gains.values())
    effects = []
    for effect in best.effects:
        own = sizes_of(effect, values)
        effects.append(FoundEffect(effect, sure[effect], own, gains[effect] / total))
    return tuple(effects)


def listed(case: Case, found: Found, choice: Choice) -> tuple[Candidate, ...]:
    """Lists the calibrated rig and all sets that were fitted or screened, by held-out cost."""
    equals = {one.effects for one in (choice.best, *choice.equals)}
    best = min([choice.best, *found.rivals], key=lambda one: one.held_out_cost)
    room = above_floor(case, found.calibrated)
    fitted = {frozenset(one.effects) for one in found.rivals}
    looked = [one for one in found.screened if frozenset(one.effects) not in fitted]
    candidates = []
    for one in sorted(
        (found.calibrated, *found.rivals, *looked), key=lambda one: one.held_out_cost
    ):
        gained = advantage(case, one, found.calibrated).relative
        keys = {ParameterKey(name): value for name, value in one.values.items()}
        own = {key: value for key, value in keys.items() if key.effect in one.effects}
        candidates.append(
            Candidate(
                one.effects,
                max(advantage(case, best, one).nats, 0.0),
                min(gained / room, 1.0) if room > 0.0 else 0.0,
                {f"{key.effect}.{key.parameter}": value for key, value in own.items()},
                one.effects in equals,
                one.cost,
                one.held_out_cost,
                one.x.size,
            )
        )
    return tuple(candidates)
