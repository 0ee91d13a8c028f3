# SPDX-License-Identifier: MIT
"""Tests on model (16) whether the paper's claims hold, for each condition of a grid.

1. The varying factor (15) converges faster than lambda = 1.
2. Its converged estimate varies less than that of lambda = 0.99.
3. It has the lowest RMSE of the three.
4. After a change of the plant, the reset of Fig. 4 lets the estimate converge again.

The recursion is that of the paper, without this estimator's guards against wind-up.

Medians with confidence intervals, and tests of a claim by paired runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.stats import binom

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import Progress, run_tasks
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.signals.excitation import multisine, prbs, random_steps

from .comparison import PLAIN, Contender, KnownPlant, Setting, known_records, run_contender
from .rig_records import DT_S, DURATION_S, MODEL_16

# A relative difference below this has no practical importance.
MATTERS = 0.05
LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """A median with its confidence interval, 95 % by default, valid for any distribution."""

    median: float
    low: float
    high: float


def median_interval(values: npt.ArrayLike, level: float = LEVEL) -> Interval:
    """Returns the median of independent values, with its exact interval from order statistics.

    The number of values below the true median is binomial with p = 1/2 (Conover, Practical
    Nonparametric Statistics, Wiley 1999, sec. 3.2). With fewer than six values no pair of them
    reaches a confidence of 95 %: the interval is then infinite.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    n = ordered.size
    # Largest k with P(X <= k - 1) <= (1 - level) / 2.
    k = int(binom.ppf(0.5 * (1.0 - level), n, 0.5))
    while k > 0 and binom.cdf(k - 1, n, 0.5) > 0.5 * (1.0 - level):
        k -= 1
    low, high = (ordered[k - 1], ordered[n - k]) if k > 0 else (-np.inf, np.inf)
    return Interval(float(np.median(ordered)), float(low), float(high))


class Finding(StrEnum):
    """Result of the paired runs on a claim that one figure is lower than another."""

    holds = "holds"
    fails = "fails"
    equal = "no difference"
    neither = "neither arrives"
    undecided = "undecided"


@dataclass(frozen=True)
class Comparison:
    """Median of the ratio of two figures in paired runs, and the finding on the claim."""

    ratio: Interval
    finding: Finding


def claim_lower(first: npt.ArrayLike, second: npt.ArrayLike) -> Comparison:
    """Tests the claim that `first` is lower than `second`, both of shape (runs,) and positive.

    The ratio first / second is taken run by run. The claim holds if the interval of the median
    ratio lies below 1 and the median below 1 - MATTERS. It fails if the interval lies above 1 and
    the median above 1 + MATTERS. There is no difference if the whole interval is within MATTERS of
    1. In all other cases the claim is undecided.
    """
    ratio = median_interval(
        np.asarray(first, dtype=np.float64) / np.asarray(second, dtype=np.float64)
    )
    if ratio.high < 1.0 and ratio.median < 1.0 - MATTERS:
        finding = Finding.holds
    elif ratio.low > 1.0 and ratio.median > 1.0 + MATTERS:
        finding = Finding.fails
    elif ratio.low >= 1.0 - MATTERS and ratio.high <= 1.0 + MATTERS:
        finding = Finding.equal
    else:
        finding = Finding.undecided
    return Comparison(ratio, finding)


ORDERS = ArxOrders(3, 3, 1)
SAMPLES = round(DURATION_S / DT_S)
INPUT_RMS = 1.5
SETTLED = 0.05


class Input(StrEnum):
    """Kinds of input signal that excite the plant, all of the same rms."""

    multisine = "multisine"
    steps = "steps"
    prbs = "prbs"


def excite(kind: Input, rng: np.random.Generator) -> FloatArray:
    """Returns an input as long as the published record, shape (2000,), rms 1.5."""
    match kind:
        case Input.multisine:
            return multisine(SAMPLES, DT_S, band_hz=(0.05, 5.0), rms=INPUT_RMS, rng=rng)
        case Input.steps:
            # Uniform levels have an rms of amplitude / sqrt(3).
            amplitude = float(np.sqrt(3.0) * INPUT_RMS)
            return random_steps(SAMPLES, amplitude=amplitude, hold=(5, 40), rng=rng)
        case Input.prbs:
            # The sequence is fixed. Its starting point is drawn at random.
            signal = prbs(2 * SAMPLES, amplitude=INPUT_RMS, hold=4, bits=10)
            first = int(rng.integers(SAMPLES))
            return signal[first : first + SAMPLES]


@dataclass(frozen=True)
class Condition:
    """Condition of a test: P(0) = p0 I, standard deviation of e(k), input, and lambda0 of (15)."""

    p0: float
    noise: float
    input: Input
    lambda0: float


@dataclass(frozen=True)
class Judged:
    """Results of claims 1 to 3 under one condition, and the final error of lambda = 1."""

    condition: Condition
    faster: Comparison
    """Settling time of the varying factor relative to that of lambda = 1."""
    calmer: Comparison
    """Spread of its converged estimate relative to that of lambda = 0.99."""
    lower_rmse: Comparison
    """Its RMSE relative to the lower one of lambda = 1 and lambda = 0.99."""
    error_of_one: Interval
    """Relative error |theta_hat - theta| / |theta| of lambda = 1 after 100 s."""


def sooner(first: npt.NDArray[np.int64], second: npt.NDArray[np.int64], never: int) -> Comparison:
    """Tests whether `first` settles sooner, from settling times in samples of paired runs.

    The value `never` stands for a run that does not settle.
    """
    # A run that starts within the tolerance counts one sample, so that the ratio is defined.
    compared = claim_lower(np.maximum(first, 1), np.maximum(second, 1))
    if np.median(first) >= never and np.median(second) >= never:
        return Comparison(compared.ratio, Finding.neither)
    return compared


def judge(
    p0: float, noise: float, kind: Input, lambda0s: Sequence[float], seeds: Sequence[int]
) -> list[Judged]:
    """Tests claims 1 to 3 for each lambda0, all on the same records, one record for each seed."""
    plant = KnownPlant.of(ORDERS, MODEL_16)
    records = known_records(plant, partial(excite, kind), noise, seeds)
    truth = plant.theta_path(SAMPLES)
    setting = Setting(ORDERS, p0=p0)
    unity = run_contender(Contender(ehsid.Constant(1.0), options=PLAIN), records, truth, setting)
    fixed = run_contender(Contender(ehsid.Constant(0.99), options=PLAIN), records, truth, setting)
    judged = []
    for lambda0 in lambda0s:
        varying = run_contender(
            Contender(ehsid.Exponential(lambda0), options=PLAIN), records, truth, setting
        )
        judged.append(
            Judged(
                Condition(p0, noise, kind, lambda0),
                faster=sooner(varying.settling(SETTLED), unity.settling(SETTLED), SAMPLES),
                calmer=claim_lower(varying.spread, fixed.spread),
                lower_rmse=claim_lower(varying.rmse, np.minimum(unity.rmse, fixed.rmse)),
                error_of_one=median_interval(unity.error[:, -1]),
            )
        )
    return judged


def map_claims(
    *,
    p0s: Sequence[float],
    noises: Sequence[float],
    inputs: Sequence[Input],
    lambda0s: Sequence[float],
    seeds: Sequence[int],
    progress: Progress | None = None,
) -> list[Judged]:
    """Tests claims 1 to 3 for all combinations of the conditions, in parallel."""
    tasks: list[Callable[[], list[Judged]]] = [
        partial(judge, p0, noise, kind, lambda0s, seeds)
        for p0, noise, kind in product(p0s, noises, inputs)
    ]
    return [judged for part in run_tasks(tasks, progress) for judged in part]


@dataclass(frozen=True)
class ResetJudged:
    """Result of claim 4 at one noise: all b are multiplied by `factor` at half of the record."""

    noise: float
    factor: float
    sooner: Comparison
    """Samples until the error stays below 5 %, as the ratio of with reset to without."""
    after: Interval
    """Samples after the change until the error stays below 5 %, with the reset."""
    fired: float
    false_alarms: float
    """Shares of the runs, 0 to 1, in which the reset fired after the change, and before it."""


def judge_reset(noise: float, factor: float, seeds: Sequence[int]) -> ResetJudged:
    """Tests claim 4: varying factor, vague start, without and with reset, on the same records."""
    at = SAMPLES // 2
    theta = np.array(MODEL_16)
    changed = theta * np.where(np.arange(theta.size) < ORDERS.na, 1.0, factor)
    plant = KnownPlant.of(ORDERS, MODEL_16).changed(at, changed)
    records = known_records(plant, partial(excite, Input.multisine), noise, seeds)
    truth, setting = plant.theta_path(SAMPLES), Setting(ORDERS)
    without, with_reset = (
        run_contender(Contender(ehsid.Exponential(), reset, PLAIN), records, truth, setting)
        for reset in (False, True)
    )
    settled = with_reset.settling(SETTLED, at)
    return ResetJudged(
        noise,
        factor,
        sooner(settled, without.settling(SETTLED, at), SAMPLES - at),
        median_interval(settled),
        fired=float(np.mean([bool((times >= at).any()) for times in with_reset.resets])),
        false_alarms=float(np.mean([bool((times < at).any()) for times in with_reset.resets])),
    )


def map_resets(
    *,
    noises: Sequence[float],
    factors: Sequence[float],
    seeds: Sequence[int],
    progress: Progress | None = None,
) -> list[ResetJudged]:
    """Tests claim 4 for all combinations of noise and factor, in parallel."""
    tasks = [
        partial(judge_reset, noise, factor, seeds) for noise, factor in product(noises, factors)
    ]
    return run_tasks(tasks, progress)
