# SPDX-License-Identifier: MIT
"""How often is one of two like causes taken for the other? python benchmarks/gap_naming.py FOLDER

A machine has one of two causes that look alike in its record. What the best fit of the other one
leaves of it is a distance d, in deviations of noise and priors together. Between two signals in
white noise of variance 1, nothing errs less than the ratio of their likelihoods, which errs with
the probability Q(d / 2) (H. van Trees, Detection, Estimation, and Modulation Theory, Wiley 1968,
ch. 2.6). The divergence of the two is D = d^2 / 2 nats, so that the bound is Q(sqrt(D / 2)).

The machine is the simulator itself. Noise is white and of known size, and the values in the rig
file differ from those of the machine as its uncertainties say. All fits are linear about the best
fit without noise, so that hundreds of draws take seconds. Each draw is named by the likelihoods of
the two fits, by the evidence of the decision, which tolerates errors of the simulator besides, and
by the answer that loses least, which may also be a set of both, or none. FOLDER keeps what is done.
With --diagnoses each cause is also put into machines that are diagnosed as any other.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from gap_visible import SETTINGS, Setting, is_named, is_seen, kept, record_of, scaled
from matplotlib.figure import Figure
from scipy.fft import idct
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares
from scipy.stats import norm

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import single_threaded_algebra
from ehsid.harness.catalogue.families import law_count
from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.catalogue.spellings import effect_values, sizes_of
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.deciding import (
    EFFECT,
    EVIDENCE,
    FALSE_ALARM,
    FURTHER_MEMBER,
    MISSED,
    SMALL,
    WRONG_NAME,
)
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.fit import step_inside
from ehsid.harness.diagnosis.model.linear import Linear
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.problem import Problem
from ehsid.harness.diagnosis.model.scale import effect_starts, machine_scale
from ehsid.harness.diagnosis.model.separation import quadratic
from ehsid.harness.diagnosis.model.spectrum import BANDS
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.search.intervals import margin
from ehsid.harness.rigs import Rig

SEED, LITTLE, SIZES = 1, 1e-4, 5
Outputs = Mapping[str, FloatArray]


def noisier(setting: Setting, factor: float) -> Setting:
    """A setting with more noise in its sensors."""
    made = setting.rig()
    louder = replace(made, sensors={name: factor * size for name, size in made.sensors.items()})
    return replace(setting, rig=lambda: louder)


@dataclass(frozen=True)
class Pair:
    """Two causes, the setting in which they are told apart, and the factors of their first sizes.

    The sensors of the settings are noisier, so that sizes that matter are near the bound.
    """

    names: tuple[str, str]
    setting: Setting
    factors: tuple[tuple[float, float], tuple[float, float]]
    """Smallest and largest, of either cause."""


PAIRS = (
    Pair(("valve_lag", "transport_delay"), noisier(SETTINGS[0], 30.0), ((0.27, 0.7), (0.5, 2.2))),
    Pair(("sensor_lag", "valve_lag"), noisier(SETTINGS[1], 10.0), ((0.38, 1.6), (0.23, 0.55))),
)
ANSWERS = ("right", "wrong", "set", "none")
SHARES = ("exact", "evidence", *ANSWERS)
DISTANCES = np.array([0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0])
# Steps of the weights that follow the errors, and a ridge, as in `search.visible`.
LINEAR_STEPS, RIDGE = 8, 1e-9


class White:
    """Turns coefficients of errors, by output, into one vector in which noise has variance 1.

    Noise of a pressure is white in the coefficients as well. Those of a position are of the
    differences of its samples, whose noise has the covariance B D D' B' with the transform B.
    """

    def __init__(self, problem: Problem, rig: Rig) -> None:
        self._problem = problem
        self.deviation = {
            name: rig.sensors[f"{name.rsplit('_', 1)[0]}_noise_{name.rsplit('_', 1)[1]}"]
            for name in problem.outputs
        }
        length = problem.records[0].full_windows[1]
        rows = np.eye(length - 1)[: min(length - 1, 1 << (BANDS - 1))]
        basis = np.diff(idct(rows, norm="ortho", axis=1), prepend=0.0, append=0.0)
        self._factor = cholesky(basis @ basis.T, lower=True)

    def __call__(self, coefficients: Outputs) -> FloatArray:
        """Whitened coefficients of one record, shape (R,) or (R, n) for derivatives."""
        parts = []
        for name in self._problem.outputs:
            (each,) = self._problem.spectrum.in_windows(coefficients[name] / self.deviation[name])
            rows = np.moveaxis(each, 1, 0)
            flat = rows.reshape(rows.shape[0], -1)
            if name == "position_m":
                flat = solve_triangular(self._factor, flat, lower=True)
            parts.append(flat.reshape(-1, *coefficients[name].shape[1:]))
        return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A cause, or none, at its best fit to a record without noise."""

    effects: tuple[str, ...]
    problem: Problem
    linear: Linear
    x: FloatArray
    """Values there, shape (n,), with their priors about those of the machine."""
    errors: FloatArray
    """Whitened errors and distances from the priors, shape (R + n,)."""
    slopes: FloatArray
    """Their derivatives with respect to x, (R + n, n)."""

    @cached_property
    def gram(self) -> FloatArray:
        """Squares of the slopes, shape (n, n), with a ridge."""
        gram = self.slopes.T @ self.slopes
        return np.asarray(gram + RIDGE * np.diag(np.diag(gram) + 1e-300))


def best_fit(
    case: Case, effects: tuple[str, ...], starts: Sequence[Mapping[str, float]], truth: list[Any]
) -> Hypothesis:
    """Fits by least squares of the whitened errors and the distances from the priors.

    starts: sizes of the effect. truth: outputs of the record, as `Problem.simulate` gives them.
    """
    problem = case.problem(effects)
    centre = problem.centre()
    problem = problem.explaining(truth, centre, np.zeros((len(problem.outputs), BANDS)))
    white, roots = White(problem, case.rig), np.sqrt(problem.information())
    free = problem.high > problem.low

    def whole(x: FloatArray) -> FloatArray:
        values = centre.copy()
        values[free] = x
        return values

    def residuals(x: FloatArray) -> FloatArray:
        values = whole(x)
        return np.concatenate([white(problem.coefficients(values)), roots * (values - centre)])

    def slopes(x: FloatArray) -> FloatArray:
        return np.vstack([white(problem.linear(whole(x)).slopes), np.diag(roots)])[:, free]

    fits = [
        least_squares(
            residuals,
            started(case, effects, sizes)[free],
            slopes,
            bounds=(problem.low[free], problem.high[free]),
            x_scale="jac",
            ftol=LITTLE,
        )
        for sizes in starts
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    x = whole(np.asarray(best.x))
    linear = problem.linear(x)
    of_all = np.vstack([white(linear.slopes), np.diag(roots)])
    return Hypothesis(effects, problem, linear, x, np.asarray(best.fun), of_all)


def started(case: Case, effects: tuple[str, ...], sizes: Mapping[str, float]) -> FloatArray:
    """Values as in the rig file, with an effect of these sizes, shape (n,)."""
    x = case.problem(effects).centre()
    own = [
        place
        for effect in effects
        for _, place in effect_parameters(effect, sizes_of(effect, sizes), case.rig.plant)
    ]
    x[x.size - len(own) :] = own
    return x


def exact_cost(hypothesis: Hypothesis, noise: FloatArray) -> float:
    """Cost, nats, of the fit to the record with this noise, (R + n,), that of white ones.

    With k free values, noise alone lowers the cost by k / 2 on average, which is added.
    """
    errors, problem = hypothesis.errors - noise, hypothesis.problem
    gradient, free = hypothesis.slopes.T @ errors, problem.high > problem.low
    low, high = problem.low - hypothesis.x, problem.high - hypothesis.x
    change = step_inside(gradient, hypothesis.gram, low, high, free)
    gain = gradient @ change + 0.5 * change @ hypothesis.gram @ change
    return float(0.5 * errors @ errors + gain + 0.5 * np.count_nonzero(free))


def scores(
    hypothesis: Hypothesis, noise: Outputs, offset: FloatArray, rig: Rig
) -> tuple[float, float]:
    """Evidence and score of the decision, nats, after a fit to the record with this noise.

    noise: its coefficients. offset: errors of the values in the rig file, shape (n,), in x.
    """
    problem, x = hypothesis.problem, hypothesis.x
    noisy = {name: hypothesis.linear.errors[name] - noise[name] for name in noise}
    errors = quadratic(problem, hypothesis.linear.at(noisy))
    prior, centre = problem.information(), problem.centre() + offset - x
    low, high = problem.low - x, problem.high - x
    power, change = errors.squares / errors.rows, np.zeros_like(x)
    for _ in range(LINEAR_STEPS):
        weights = errors.independent / (errors.rows * (power + errors.tolerated))
        hessian = np.tensordot(weights, errors.grams, axes=1) + np.diag(prior)
        hessian += RIDGE * np.diag(np.diag(hessian) + 1e-300)
        gradient = weights @ errors.products - prior * centre
        change = step_inside(gradient, hessian, low, high, high > low)
        squares = errors.squares + 2.0 * errors.products @ change
        squares += np.einsum("i,bij,j->b", change, errors.grams, change, optimize=True)
        power = np.maximum(squares, 0.0) / errors.rows
    logs = errors.independent @ np.log1p(power / errors.tolerated)
    evidence = -0.5 * EVIDENCE * float(logs / errors.independent.sum())
    if not hypothesis.effects:
        return evidence, evidence
    (effect,) = hypothesis.effects
    values = {
        parameter.name: parameter.value(float(place))
        for parameter, place in zip(problem.parameters, x + change, strict=True)
    }
    if not catalogue()[effect].matters(sizes_of(effect, values), machine_scale(rig)):
        return evidence, -np.inf  # nobody names an effect that every servo has
    small = 1.0 - margin(effect, values, rig)
    return evidence, evidence - EFFECT * law_count((effect,)) - SMALL * small


def answer(right: float, wrong: float, none: float) -> str:
    """The answer that loses least among a name, a set of both, and none, from three scores."""
    of_right, of_wrong, of_none = np.exp(np.array([right, wrong, none]) - max(right, wrong, none))
    losses = {
        "right": WRONG_NAME * of_wrong + FALSE_ALARM * of_none,
        "wrong": WRONG_NAME * of_right + FALSE_ALARM * of_none,
        "set": FURTHER_MEMBER * (of_right + of_wrong) + FALSE_ALARM * of_none,
        "none": MISSED * (of_right + of_wrong),
    }
    return min(losses, key=lambda name: losses[name])


def point(pair: Pair, turned: bool, factor: float, draws: int) -> dict[str, Any]:
    """Shares of errors with one of a pair in the machine, of this factor of its first size."""
    true, other = reversed(pair.names) if turned else pair.names
    rig = pair.setting.rig()
    case = make_case(rig, [record_of(pair.setting, SEED, {})])
    case = replace(case, training=case.records, blocks=False)
    sizes = scaled(true, effect_starts(true, rig)[0], factor)
    truth = case.problem((true,)).simulate(started(case, (true,), sizes))
    right = best_fit(case, (true,), [sizes], truth)
    others = [effect_values(other, start) for start in effect_starts(other, rig)]
    wrong, none = best_fit(case, (other,), others, truth), best_fit(case, (), [{}], truth)
    white = White(right.problem, rig)

    rng = np.random.default_rng([SEED, int(turned), round(1e3 * factor)])
    shared = none.problem.information()  # of the values of the rig, which come first in all three
    deviations = np.where(shared > 0.0, np.maximum(shared, 1e-300) ** -0.5, 0.0)
    exact, evidence, answers = 0, 0, Counter[str]()
    nothing = np.zeros_like(wrong.errors)
    for _ in range(draws):
        noisy = [
            {
                name: outputs[name]
                + white.deviation[name] * rng.standard_normal(outputs[name].size)
                for name in case.outputs
            }
            for outputs in truth
        ]
        noise = right.problem.coefficients_of(noisy)
        whitened, offset = white(noise), deviations * rng.standard_normal(deviations.size)
        costs, found = [], []
        for one in (right, wrong, none):
            own_offset = np.pad(offset, (0, one.x.size - offset.size))
            of_priors = np.sqrt(one.problem.information()) * own_offset
            costs.append(exact_cost(one, np.concatenate([whitened, of_priors])))
            found.append(scores(one, noise, own_offset, rig))
        exact += costs[1] < costs[0]
        evidence += found[1][0] > found[0][0]
        answers[answer(*(score for _, score in found))] += 1
    return {
        "true": true,
        "other": other,
        "sizes": sizes,
        "D": exact_cost(wrong, nothing) - exact_cost(replace(wrong, errors=nothing), nothing),
        "exact": exact / draws,
        "evidence": evidence / draws,
    } | {name: answers[name] / draws for name in ANSWERS}


def diagnosed(pair: Pair, turned: bool, factor: float, seed: int) -> str:
    """The answer of a whole diagnosis, one of ANSWERS, or "another"."""
    true, other = reversed(pair.names) if turned else pair.names
    rig = pair.setting.rig()
    sizes = scaled(true, effect_starts(true, rig)[0], factor)
    options = DiagnosisOptions((), "list")
    found = diagnose([record_of(pair.setting, seed, sizes)], rig, options=options)
    row = {"verdict": found.verdict, "sets": [list(each) for each in found.ambiguity_set]}
    if not is_seen(row):
        return "none"
    if not is_named(true, row):
        return "wrong" if is_named(other, row) else "another"
    return "right" if len(row["sets"]) == 1 else "set"


def bound(distance: FloatArray) -> FloatArray:
    """Q(sqrt(D / 2)), the least share of errors at a divergence of D nats."""
    return np.asarray(norm.sf(np.sqrt(0.5 * distance)))


def averaged(points: Sequence[Mapping[str, Any]], distances: FloatArray) -> dict[str, FloatArray]:
    """Shares of a pair at these divergences, interpolated over ln D; either cause is as frequent.

    The mean of both counts: a choice that always takes the one errs less on machines with that one.
    """
    found: dict[str, list[FloatArray]] = {}
    for true in dict.fromkeys(one["true"] for one in points):
        own = sorted((one for one in points if one["true"] == true), key=lambda one: one["D"])
        logs = np.log([one["D"] for one in own])
        for name in SHARES:
            at = np.interp(np.log(distances), logs, [one[name] for one in own])
            found.setdefault(name, []).append(at)
    return {name: np.mean(shares, axis=0) for name, shares in found.items()}


def table(pairs: Sequence[Sequence[Mapping[str, Any]]]) -> str:
    """The mean of all pairs at some divergences, as Markdown, in %."""
    shares = [averaged(points, DISTANCES) for points in pairs]
    mean = {name: np.mean([one[name] for one in shares], axis=0) for name in shares[0]}
    lines = ["| D, nats | bound | " + " | ".join(mean) + " |", "|---" * (2 + len(mean)) + "|"]
    for place, distance in enumerate(DISTANCES):
        row = [float(bound(distance)), *(float(each[place]) for each in mean.values())]
        lines.append(f"| {distance:g} | " + " | ".join(f"{100 * x:.1f}" for x in row) + " |")
    return "\n".join(lines)


def picture(pairs: Sequence[Sequence[Mapping[str, Any]]]) -> Figure:
    """Left the errors of a choice between the two, right what is answered, over the divergence."""
    figure = Figure(figsize=(9.6, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.loglog(DISTANCES, bound(DISTANCES), color="black", label=r"$Q(\sqrt{D/2})$")
    shares = [averaged(points, DISTANCES) for points in pairs]
    for points, one, style in zip(pairs, shares, ("o", "s"), strict=True):
        words = f"{points[0]['true']} or {points[0]['other']}".replace("_", " ")
        for name, colour in (("exact", "#0072b2"), ("evidence", "#d55e00")):
            seen = np.where(one[name] > 0.0, one[name], np.nan)
            label = words if name == "exact" else None
            left.loglog(DISTANCES, seen, style, color=colour, ms=5, label=label)
    left.set(ylim=(2e-3, 1.0), ylabel="share of wrong choices")
    for name, colour in zip(ANSWERS, ("#009e73", "#d55e00", "#0072b2", "#999999"), strict=True):
        mean = 100.0 * np.mean([one[name] for one in shares], axis=0)
        right.semilogx(DISTANCES, mean, "o-", color=colour, ms=4, label=name)
    right.set(ylabel="share of answers in %")
    for axes in (left, right):
        axes.set(xlabel="divergence of the two causes in nats")
        axes.legend(fontsize=8)
    return figure


def main() -> None:
    """Print what is found at each size, and draw it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument(
        "--diagnoses", type=int, default=0, help="of each cause, at its largest size"
    )
    parser.add_argument("--picture", type=Path)
    told = parser.parse_args()
    told.folder.mkdir(parents=True, exist_ok=True)
    pairs: list[list[Any]] = []
    with single_threaded_algebra():
        for pair in PAIRS:
            pairs.append([])
            for turned in (False, True):
                head = "-".join([*pair.names, str(int(turned))])
                for factor in np.geomspace(*pair.factors[turned], SIZES).tolist():
                    name = f"{head}-{factor:.3g}"
                    made = partial(point, pair, turned, factor, told.draws)
                    pairs[-1].append(one := kept(told.folder / f"{name}.json", made))
                    print(name, {key: one[key] for key in ("D", *SHARES)}, flush=True)
                answers, most = Counter[str](), pair.factors[turned][1]
                for seed in range(201, 201 + told.diagnoses):
                    whole = partial(diagnosed, pair, turned, most, seed)
                    answers[kept(told.folder / f"whole-{head}-{seed}.json", whole)] += 1
                print("whole diagnoses", head, f"{most:g}", dict(answers), flush=True)
    print(table(pairs))
    if told.picture is not None:
        picture(pairs).savefig(told.picture, dpi=100)


if __name__ == "__main__":
    main()
