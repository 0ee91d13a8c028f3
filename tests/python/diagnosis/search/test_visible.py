# SPDX-License-Identifier: MIT
"""How small an effect could be seen, against dense matrices and differences of simulations."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from gap_cases import OFF, RIG, record
from scipy.fft import dct
from scipy.optimize import minimize

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.spellings import effect_values
from ehsid.harness.diagnosis.deciding import EFFECT, EVIDENCE, FALSE_ALARM, MISSED
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.scale import machine_scale
from ehsid.harness.diagnosis.search.candidates import calibrate
from ehsid.harness.diagnosis.search.intervals import matters
from ehsid.harness.diagnosis.search.visible import (
    Ground,
    could_be_seen,
    ground_of,
    linear_refit,
    shown,
    smallest,
    stays,
)

PRESSURES = ("position_m", "pressure_a_pa", "pressure_b_pa")
DELAY, FORCE, LEAKAGE = "transport_delay", "load_force", "internal_leakage"
LARGE = [(DELAY, {"delay_s": 4e-3}), (FORCE, {"force_n": 2e3})]


@pytest.fixture(scope="module", params=[PRESSURES, PRESSURES[:1]], ids=["pressures", "position"])
def ground(request: pytest.FixtureRequest) -> Ground:
    return ground_of(make_case(RIG, [record(OFF, 1, request.param)]))


def octaves(ground: Ground, runs: Sequence[Mapping[str, FloatArray]]) -> list[FloatArray]:
    """Coefficients of K runs by output and octave, (rows, K) each, by the transform alone."""
    (compared,) = ground.problem.records
    windows, length = compared.full_windows
    found = []
    for name in ground.problem.outputs:
        inside = np.stack([run[name][compared.used] for run in runs], axis=-1)
        inside = inside[: windows * length].reshape(windows, length, -1)
        if name == "position_m":
            inside = np.diff(inside, axis=1)
        c = dct(inside, axis=1, norm="ortho")
        ends = [0, *(1 << k for k in range(9))]
        parts = [c[:, a:b].reshape(-1, c.shape[2]) for a, b in itertools.pairwise(ends)]
        found += [rows for rows in parts if rows.size]
    return found


def with_effect(ground: Ground, effect: str, sizes: Mapping[str, float]) -> dict[str, FloatArray]:
    problem = ground.case.problem((effect,))
    own = [x for _, x in effect_parameters(effect, sizes)]
    return problem.simulate(np.append(ground.x, own))[0]


def movable(ground: Ground) -> set[str]:
    """Values that may absorb an effect."""
    return {each.name for each in ground.case.parameters() if each.low < each.high}


def dense(ground: Ground, effect: str, sizes: Mapping[str, float]) -> list[FloatArray]:
    """Columns by octave: the difference that the effect makes, and central differences of the rig.

    The latter are in standard deviations of the priors; values that may not move have none.
    """
    problem = ground.problem
    runs = [with_effect(ground, effect, sizes), problem.simulate(ground.x)[0]]
    for i, parameter in enumerate(problem.parameters):
        if parameter.name not in movable(ground):
            continue
        h = np.zeros(ground.x.size)
        h[i] = 1e-4 * parameter.sigma
        runs += [problem.simulate(ground.x + h)[0], problem.simulate(ground.x - h)[0]]
    found = []
    for rows in octaves(ground, runs):
        slopes = (rows[:, 2::2] - rows[:, 3::2]) / 2e-4
        found.append(np.hstack([rows[:, 1:2] - rows[:, :1], slopes]))
    return found


def refit_of(ground: Ground, effect: str, sizes: Mapping[str, float]) -> FloatArray:
    problem, linear = shown(ground, effect, sizes)
    assert linear is not None
    return linear_refit(problem, linear, ground.x)[0]


def used(ground: Ground, by_band: FloatArray) -> FloatArray:
    """Of an array (outputs, BANDS), what belongs to octaves that the sampling reaches."""
    names = ground.problem.outputs
    return by_band[np.stack([ground.problem.likelihoods[name].counts for name in names]) > 0.0]


def tolerated(ground: Ground) -> FloatArray:
    """Power of each octave that is no reason for an effect: it is tolerated, or stays anyway."""
    names = ground.problem.outputs
    own = np.stack([ground.problem.likelihoods[name].tolerated for name in names])
    return used(ground, own + ground.left)


def counts(ground: Ground) -> FloatArray:
    """One independent error for each octave of a window, and no more than it has coefficients."""
    windows = ground.problem.records[0].full_windows[0]
    return np.full(used(ground, ground.left).size, float(windows))


def test_what_stays_after_a_small_effect_is_that_of_weighted_least_squares(ground: Ground) -> None:
    """Far below the tolerance the weights are constant: one system of equations, dense."""
    sizes = {"coefficient_m3_s_pa": 1e-15}
    columns = dense(ground, LEAKAGE, sizes)
    other = tolerated(ground)
    n = counts(ground)
    weights = [np.sqrt(n[b] / (rows.shape[0] * other[b])) for b, rows in enumerate(columns)]
    whitened = np.vstack([w * rows for w, rows in zip(weights, columns, strict=True)])
    d, slopes = whitened[:, 0], whitened[:, 1:]
    prior = np.eye(slopes.shape[1])
    tau, *_ = np.linalg.lstsq(
        np.vstack([slopes, prior]), np.append(-d, np.zeros(prior.shape[0])), rcond=None
    )
    expected = [np.mean((rows[:, 0] + rows[:, 1:] @ tau) ** 2) for rows in columns]
    before = [np.mean(rows[:, 0] ** 2) for rows in columns]
    found = used(ground, refit_of(ground, LEAKAGE, sizes))
    np.testing.assert_allclose(found, expected, rtol=0.05, atol=1e-3 * max(before))
    assert n @ (found / other) < n @ (np.array(before) / other)


@pytest.mark.parametrize(("effect", "sizes"), LARGE)
def test_what_stays_after_a_large_effect_is_the_least_cost(
    ground: Ground, effect: str, sizes: dict[str, float]
) -> None:
    """The cost of the fit itself, minimised over all values by a method of its own."""
    columns, other, n = (
        dense(ground, effect, sizes),
        tolerated(ground),
        counts(ground),
    )
    bounds = [
        ((p.low - x) / p.sigma, (p.high - x) / p.sigma)
        for p, x in zip(ground.problem.parameters, ground.x, strict=True)
        if p.name in movable(ground)
    ]
    grams = np.stack([rows.T @ rows / rows.shape[0] for rows in columns])

    def cost(tau: FloatArray) -> tuple[float, FloatArray]:
        whole = np.append(1.0, tau)
        powers = np.einsum("i,bij,j->b", whole, grams, whole)
        slope = (grams @ whole)[:, 1:].T @ (n / (powers + other))
        return 0.5 * float(n @ np.log(powers + other) + tau @ tau), slope + tau

    start = np.zeros(columns[0].shape[1] - 1)
    least = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds)
    paid = 0.5 * float(least.x @ least.x)
    found = 0.5 * float(n @ np.log(used(ground, refit_of(ground, effect, sizes)) + other))
    assert found == pytest.approx(least.fun - paid, abs=0.02 * (cost(start)[0] - least.fun) + 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "sizes"), LARGE)
def test_a_fit_to_a_record_with_the_effect_leaves_as_much(
    ground: Ground, effect: str, sizes: dict[str, float]
) -> None:
    """The record has the effect and noise; what it leaves has the power of both together."""
    told = ground_of(ground.case, calibrate(ground.case))
    values = {**OFF, **effect_values(effect, sizes)}
    case = make_case(RIG, [record(values, 1, ground.problem.outputs)])
    fitted = calibrate(case)
    n, other = counts(ground), tolerated(told)

    def gain(powers: FloatArray) -> float:
        return EVIDENCE * float(n @ np.log(powers / other)) / (2.0 * n.sum())

    rows = sum(case.problem(held_out=part).spectrum.sizes for part in (False, True))
    left = (fitted.fit_powers.sum(axis=0) + fitted.powers.sum(axis=0)) / np.maximum(rows, 1.0)
    tolerances = other - used(told, told.left)
    expected = gain(used(told, stays(told, effect, sizes)) + other)
    found = gain(used(told, left) + tolerances)
    if effect == FORCE and not ground.case.pressures:
        # Edges of the valve absorb it: what stays is no reason for a name.
        assert max(found, expected) < EFFECT
    else:
        assert found == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("effect", [DELAY, LEAKAGE, FORCE, "valve_null_bias"])
def test_the_size_is_that_at_which_the_score_gains_as_much_as_a_name_costs(
    ground: Ground, effect: str
) -> None:
    found = smallest(ground, effect)
    assert found.limit == "record"
    other, n = tolerated(ground), counts(ground)
    left, excess = used(ground, ground.left), []
    for factor in (0.85, 1.0, 1.15):
        sizes = {name: factor * size for name, size in found.sizes.items()}
        power = used(ground, stays(ground, effect, sizes))
        gain = EVIDENCE * float(n @ np.log((power + other) / other)) / (2.0 * n.sum())
        half = EVIDENCE * n / (2.0 * n.sum() * (power + other))
        gain -= 1.2816 * math.sqrt(float(half**2 @ (4.0 * power * left / n)))
        excess.append(gain - EFFECT - math.log(FALSE_ALARM / MISSED))
    # The further cost of a size near the least one is never negative.
    assert excess[0] < excess[1] < excess[2]
    assert excess[2] > 0.0
    values = effect_values(effect, found.sizes)
    assert matters(effect, values, RIG)
    if matters(effect, {name: size / math.e for name, size in values.items()}, RIG):
        assert excess[0] < 0.0


def test_least_sizes_and_effects_that_no_size_shows(ground: Ground) -> None:
    asked = ("makeup_check", "valve_hysteresis", "sensor_quantisation", DELAY)
    never, always, decided = could_be_seen(ground, asked)
    assert (never.limit, math.isnan(never.size)) == ("none", True)
    assert (always.limit, decided.limit) == ("least_size", "record")
    # Threshold of a new valve: 0.4 % of full opening.
    assert always.size == pytest.approx(0.004, rel=0.02)
    assert decided.size == decided.sizes[decided.parameter] > 1e-3


def test_no_force_is_told_against_which_the_machine_does_not_move(ground: Ground) -> None:
    """What the record leaves hides so much that without this bound larger ones would be told."""
    hardly = replace(ground, left=1e6 * ground.left)
    found = smallest(hardly, FORCE)
    assert found.limit == "none" or found.size <= machine_scale(RIG).force_n
