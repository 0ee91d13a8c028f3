# SPDX-License-Identifier: MIT
"""Minimisation of the cost of a problem by the Levenberg-Marquardt method inside bounds.

J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, ch. 10 and 16.7. A step
changes the parameters that are not held at a bound. It is then projected into the bounds.

Unknown inputs of an equation as sums of hat functions inside the windows of a record.

A hat is one at its node and falls to zero at the two next ones; beyond the outer nodes of a window
it stays. Their sum is one: an input is linear between nodes. The windows follow each other, and a
hat in one of them acts on the next one only through the state that is carried over. Hats at the
same place of all windows of even number therefore are one direction of the simulator, and those of
odd number another one: two runs' worth of derivatives give the response of every window to its own
hats.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from .comparison import Compared
from .linear import Linear
from .problem import Problem, Step

# Integration steps per sample in a fit. At 1 kHz, two resolve an oil spring of 100 Hz to 0.1 %.
SUBSTEPS = 2
# Iterations of a fit. After the calibration the cost is nearly a parabola.
ITERATIONS = 12

DAMPING = 1e-2
DAMPING_DECREASE, DAMPING_INCREASE = 1.0 / 6.0, 8.0
# Successful steps reduce the damping, down to 1e-9. From there it takes this many tries until the
# damping makes a step short.
TRIES = 10
TRIES_STALE = 2
# A smaller decrease in cost counts as no decrease. Costs are log-likelihoods, in which a difference
# of 1 is about a standard error.
GAIN = 1e-2
# Two fits of one problem that were stopped after their iterations differ by less than this, nats.
BEHIND_NATS = 1.0
# Number of steps from an evaluation of exact sensitivities to the next, and the smallest ratio of
# actual to predicted decrease with which a fit continues without an evaluation.
SENSITIVITY_STEPS = 4
AGREEMENT = 0.25


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit."""

    x: FloatArray
    """Shape (n,), final parameters, inside the bounds."""
    cost: float
    """Cost at x, nats."""
    iterations: int
    """Number of steps taken."""
    converged: bool
    """True if the last step decreased the cost by less than GAIN, or no step decreased it."""


def fit(
    problem: Problem, start: FloatArray, *, iterations: int = 15, first: Linear | None = None
) -> Fit:
    """Minimises the cost of a problem in at most `iterations` >= 1 steps; see `descent`."""
    *_, last = itertools.islice(descent(problem, start, first), iterations)
    return last


def descent(problem: Problem, start: FloatArray, first: Linear | None = None) -> Iterator[Fit]:
    """Yields the fit after each step from a start, which is first moved inside the bounds.

    The steps end when the fit has converged. Exact sensitivities cost ten simulations. They are
    computed at the start, after SENSITIVITY_STEPS steps, or if the cost does not decrease as
    predicted. In between they are updated from the errors at each new point; `age` counts these
    updates. `first` replaces the sensitivities of the first parameters at the start.
    """
    x = np.clip(np.asarray(start, dtype=np.float64), problem.low, problem.high)
    damping = DAMPING
    linear, age = problem.linear(x, first), 0 if first is None else 1
    model = problem.form(x, linear)
    for iteration in itertools.count():
        point = _try(problem, x, model, damping, TRIES if age == 0 else TRIES_STALE)
        if point is None:
            yield Fit(x, model.cost, iteration if age == 0 else iteration + 1, age == 0)
            if age == 0:
                return
            linear, age = problem.linear(x), 0
            model = problem.form(x, linear)
            continue
        decrease, predicted = model.cost - point.cost, point.predicted
        step, x = point.x - x, point.x
        converged = decrease < GAIN and age == 0
        yield Fit(x, point.cost, iteration + 1, converged)
        if converged:
            return
        damping = max(point.damping * DAMPING_DECREASE, 1e-9)
        if decrease < GAIN or decrease < AGREEMENT * predicted or age + 1 == SENSITIVITY_STEPS:
            linear, age = problem.linear(x), 0
        else:
            linear, age = linear.updated(step, point.errors, np.diag(model.hessian)), age + 1
        model = problem.form(x, linear)


def best_of(descents: Sequence[Iterator[Fit]], *, iterations: int, kept: int) -> Fit:
    """Takes a step from each of several starts, then the others from the `kept` best of them.

    Returns the fit of the lowest cost after at most `iterations` steps from any start.
    """
    fits = [next(each) for each in descents]
    order = sorted(range(len(fits)), key=lambda i: fits[i].cost)
    for i in order[:kept]:
        for later in itertools.islice(descents[i], iterations - 1):
            fits[i] = later
    return min(fits, key=lambda each: each.cost)


@dataclass(frozen=True, eq=False)
class _Point:
    """A point of lower cost, its errors, the damping that led there, and the predicted decrease."""

    x: FloatArray
    cost: float
    errors: Mapping[str, FloatArray]
    damping: float
    predicted: float


def _try(problem: Problem, x: FloatArray, model: Step, damping: float, tries: int) -> _Point | None:
    """Tries damped steps, each shorter than the last, until the cost decreases.

    The result is None if no step decreases the cost. So it is where a simulation diverges: its
    sensitivities overflow.
    """
    if not (np.isfinite(model.gradient).all() and np.isfinite(model.hessian).all()):
        return None
    at_bound = ((x <= problem.low) & (model.gradient > 0.0)) | (
        (x >= problem.high) & (model.gradient < 0.0)
    )
    diagonal = np.diag(model.hessian)
    # A parameter that has no influence must not make the matrix singular. One in Pa has a curvature
    # that is smaller than others by 1e-15, and is to move as freely.
    floor = 1e-24 * float(diagonal[~at_bound].max(initial=1e-300))
    for _ in range(tries):
        damped = model.hessian + damping * np.diag(diagonal + floor)
        step = step_inside(model.gradient, damped, problem.low - x, problem.high - x, ~at_bound)
        candidate = np.clip(x + step, problem.low, problem.high)
        errors = problem.coefficients(candidate)
        cost = problem.cost_of(candidate, errors)
        if cost < model.cost:
            taken = candidate - x
            predicted = -float(model.gradient @ taken + 0.5 * taken @ model.hessian @ taken)
            return _Point(candidate, cost, errors, damping, predicted)
        damping = max(damping * DAMPING_INCREASE, 1e-4)
    return None


def step_inside(
    gradient: FloatArray,
    hessian: FloatArray,
    low: FloatArray,
    high: FloatArray,
    free: npt.NDArray[np.bool_],
) -> FloatArray:
    """Step, shape (n,), that nearly minimises a quadratic model inside bounds of the step.

    Parameters that are not free stay. Those that would cross a bound go to it, and the others are
    determined anew, until none crosses: a step that is cut off at the bounds afterwards can lead
    uphill where parameters stand in for one another.
    """
    step, free = np.zeros_like(gradient), free.copy()
    while free.any():
        rest = gradient[free] + hessian[np.ix_(free, ~free)] @ step[~free]
        step[free] = -np.linalg.solve(hessian[np.ix_(free, free)], rest)
        crossing = free & ((step < low) | (step > high))
        if not crossing.any():
            break
        step = np.clip(step, low, high)
        free &= ~crossing
    return step


# Distance of the nodes, s: unknown inputs up to 25 Hz. Slowly sampled records have fewer.
SPACING_S = 0.02
LEAST_SAMPLES = 2
LEAST_HATS = 3


@dataclass(frozen=True, eq=False)
class Hats:
    """The hat functions of a record with W windows of L samples."""

    begins: npt.NDArray[np.int64]
    """First sample of each window, shape (W,)."""
    shapes: FloatArray
    """The n hats of a window, shape (n, L)."""
    spacing_s: float
    """Distance of the nodes, s."""
    samples: int
    """Number of samples of the record."""

    @property
    def count(self) -> int:
        """Number n of the hats of a window."""
        return int(self.shapes.shape[0])

    def signals(self) -> FloatArray:
        """The 2 n directions, those of the windows of even number first, shape (2 n, samples)."""
        signals = np.zeros((2 * self.count, self.samples))
        for number, begin in enumerate(self.begins.tolist()):
            first = (number % 2) * self.count
            signals[first : first + self.count, begin : begin + self.shapes.shape[1]] = self.shapes
        return signals

    def own(self, by_direction: FloatArray) -> FloatArray:
        """Of what each window shows for all directions, (W, ..., 2 n), its own, (W, ..., n)."""
        own = np.array(by_direction[..., : self.count])
        own[1::2] = by_direction[1::2, ..., self.count : 2 * self.count]
        return own

    def at_nodes(self, signal: FloatArray) -> FloatArray:
        """Means of a signal (samples, ...) over each hat, shape (W, n, ...)."""
        weights = self.shapes / self.shapes.sum(axis=1, keepdims=True)
        length = self.shapes.shape[1]
        windows = np.stack([signal[b : b + length] for b in self.begins.tolist()])
        return np.asarray(np.einsum("nl,wl...->wn...", weights, windows, optimize=True))


def hats(record: Compared) -> Hats:
    """The hat functions of the full windows of a record."""
    windows, length = record.full_windows
    most = max(LEAST_HATS, length // LEAST_SAMPLES)
    count = min(max(round(length * record.dt_s / SPACING_S), LEAST_HATS), most)
    place = np.clip((np.arange(length) + 0.5) * count / length - 0.5, 0.0, count - 1.0)
    shapes = np.maximum(1.0 - np.abs(place - np.arange(count)[:, np.newaxis]), 0.0)
    samples = np.flatnonzero(record.used)
    number = record.window[samples]
    begins = samples[np.flatnonzero(np.diff(number, prepend=-1))][:windows]
    return Hats(begins, shapes, length * record.dt_s / count, len(record.record))
