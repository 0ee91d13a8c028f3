# SPDX-License-Identifier: MIT
"""The optimiser on costs whose minimum scipy computes, too."""

from collections.abc import Iterator, Mapping
from typing import cast

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from made_spectra import spectrum_of
from scipy.optimize import least_squares, lsq_linear

from ehsid.harness.diagnosis import Problem, fit
from ehsid.harness.diagnosis.model.fit import Fit, best_of, descent
from ehsid.harness.diagnosis.model.linear import Linear
from ehsid.harness.diagnosis.model.problem import Step


class Quadratic:
    """The cost |A (x + cubic x^3) - b|^2 / 2 inside bounds, with the interface of `Problem`."""

    def __init__(self, a: np.ndarray, b: np.ndarray, half: float, cubic: float = 0.0) -> None:
        self.a, self.b, self.cubic = a, b, cubic
        self.low, self.high = np.full(a.shape[1], -half), np.full(a.shape[1], half)
        self.exact = 0  # number of evaluations of sensitivities
        self.spectrum = spectrum_of((1, a.shape[0]))

    def coefficients(self, x: np.ndarray) -> dict[str, np.ndarray]:
        return {"y": self.a @ (x + self.cubic * x**3) - self.b}

    def linear(self, x: np.ndarray, first: Linear | None = None) -> Linear:
        self.exact += 1
        slopes = self.a * (1.0 + 3.0 * self.cubic * x**2)
        if first is not None:
            slopes[:, : first.slopes["y"].shape[1]] = first.slopes["y"]
        return Linear(self.spectrum, self.coefficients(x), {"y": slopes})

    def form(self, x: np.ndarray, linear: Linear) -> Step:
        error, slopes = linear.errors["y"], linear.slopes["y"]
        return Step(self.cost_of(x, linear.errors), slopes.T @ error, slopes.T @ slopes)

    def cost_of(self, x: np.ndarray, errors: Mapping[str, np.ndarray]) -> float:
        return float(0.5 * np.sum(errors["y"] ** 2))

    def cost(self, x: np.ndarray) -> float:
        return self.cost_of(x, self.coefficients(x))


@given(seed=st.integers(0, 500), half=st.floats(0.05, 5.0))
def test_minimum_in_a_box_is_that_of_scipy(seed: int, half: float) -> None:
    rng = np.random.default_rng(seed)
    # The columns are correlated, so that a step must take into account which parameters are held at
    # a bound.
    a = rng.standard_normal((12, 4)) @ (np.eye(4) + 2.0 * rng.standard_normal((4, 4)))
    subject = Quadratic(a, 3.0 * rng.standard_normal(12), half)
    result = fit(cast(Problem, subject), rng.uniform(-half, half, 4), iterations=200)
    expected = lsq_linear(a, subject.b, (-half, half), tol=1e-14)
    assert np.all(np.abs(result.x) <= half)
    # A fit ends where a step reduces the cost by less than 1e-2; damping leaves a few such steps.
    assert result.cost < expected.cost + 0.05 * (1.0 + expected.cost)


@pytest.mark.parametrize("seed", range(6))
def test_a_bound_of_one_parameter_determines_the_others_anew(seed: int) -> None:
    # Columns that stand in for one another: a step that is cut off at the bounds afterwards leads
    # uphill, and then only short steps are taken, more than a hundred of them.
    rng = np.random.default_rng(seed)
    a = rng.standard_normal((60, 12)) @ np.linalg.matrix_power(np.tril(np.ones((12, 12))), 2)
    unbounded = np.where(rng.random(12) < 0.4, 2.5, 0.6) * rng.choice([-1.0, 1.0], 12)
    subject = Quadratic(a, a @ unbounded, 1.0)
    result = fit(cast(Problem, subject), np.zeros(12), iterations=5)
    expected = lsq_linear(a, subject.b, (-1.0, 1.0), tol=1e-14)
    assert np.all(np.abs(result.x) <= 1.0)
    # Of the start, 4,000 to 500,000; a step that reduces it by less than 1e-2 ends the fit.
    assert result.cost < expected.cost + 0.02


def test_a_start_outside_the_bounds_is_clipped_and_the_cost_never_rises() -> None:
    subject = Quadratic(np.eye(2), np.array([10.0, 0.0]), 1.0)
    result = fit(cast(Problem, subject), np.array([-50.0, 50.0]))
    np.testing.assert_allclose(result.x, [1.0, 0.0], atol=0.05)
    assert result.converged
    assert result.cost <= subject.cost(np.array([-1.0, 1.0]))


@pytest.mark.parametrize(("gradient", "hessian"), [(1e143, np.inf), (np.nan, 1.0)])
def test_no_step_is_tried_where_sensitivities_overflow(gradient: float, hessian: float) -> None:
    """As those of a simulation that diverges: LAPACK may call such a matrix singular."""

    class Diverging(Quadratic):
        runs = 0

        def coefficients(self, x: np.ndarray) -> dict[str, np.ndarray]:
            self.runs += 1
            return super().coefficients(x)

        def form(self, x: np.ndarray, linear: Linear) -> Step:
            cost = self.cost_of(x, linear.errors)
            return Step(cost, np.full(2, gradient), np.full((2, 2), hessian))

    subject, start = Diverging(np.eye(2), np.array([10.0, 0.0]), 1.0), np.array([0.5, 0.5])
    result = fit(cast(Problem, subject), start)
    np.testing.assert_array_equal(result.x, start)
    assert (result.iterations, subject.runs) == (0, 1)
    assert result.cost == subject.cost(start)


def test_the_limit_of_iterations_holds() -> None:
    subject = Quadratic(np.diag([1.0, 1e3]), np.array([1.0, 1.0]), 5.0)
    result = fit(cast(Problem, subject), np.array([4.0, 4.0]), iterations=1)
    assert result.iterations == 1
    assert not result.converged
    assert result.cost == pytest.approx(subject.cost(result.x))


@pytest.mark.slow
@given(seed=st.integers(0, 500))
@example(seed=298)  # six tries do not shorten the steps enough
def test_the_minimum_of_a_nonlinear_cost_is_that_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # x + x^3 / 2 is monotone and the columns are independent: there is a single minimum.
    a = np.linalg.qr(rng.standard_normal((12, 4)))[0] * np.array([1.0, 3.0, 10.0, 30.0])
    subject = Quadratic(a, 3.0 * rng.standard_normal(12), 2.0, cubic=0.5)
    start = rng.uniform(-2.0, 2.0, 4)
    result = fit(cast(Problem, subject), start, iterations=100)
    expected = least_squares(
        lambda x: subject.coefficients(x)["y"],
        start,
        lambda x: subject.linear(x).slopes["y"],
        bounds=(-2.0, 2.0),
        xtol=1e-12,
        ftol=1e-12,
    )
    # The fit ends where a step with exact sensitivities reduces the cost by less than 1e-2.
    assert result.cost < expected.cost + 0.05 * (1.0 + expected.cost)


def test_sensitivities_are_not_computed_in_every_step() -> None:
    rng = np.random.default_rng(0)
    subject = Quadratic(rng.standard_normal((12, 4)), rng.standard_normal(12), 9.0, cubic=0.01)
    result = fit(cast(Problem, subject), np.full(4, 2.0), iterations=30)
    assert result.converged
    assert subject.exact < result.iterations


def test_a_fit_can_start_with_sensitivities_of_a_nearby_point() -> None:
    rng = np.random.default_rng(1)
    subject = Quadratic(rng.standard_normal((12, 4)), rng.standard_normal(12), 9.0, cubic=0.01)
    near = subject.linear(np.zeros(4))
    first = Linear(subject.spectrum, near.errors, {"y": near.slopes["y"][:, :3]})
    start = np.full(4, 1.0)
    approximate = fit(cast(Problem, subject), start, iterations=30, first=first)
    exact = fit(cast(Problem, subject), start, iterations=30)
    assert approximate.cost == pytest.approx(exact.cost, abs=1e-2 * 30)


def test_a_step_without_influence_leaves_the_slopes_unchanged() -> None:
    slopes = np.array([[1.0, 0.0], [2.0, 0.0]])
    before = Linear(spectrum_of((1, 2)), {"y": np.zeros(2)}, {"y": slopes.copy()})
    after = before.updated(np.array([0.0, 3.0]), {"y": np.ones(2)}, np.array([5.0, 0.0]))
    np.testing.assert_array_equal(after.slopes["y"], slopes)
    np.testing.assert_array_equal(after.errors["y"], np.ones(2))


@given(seed=st.integers(0, 100))
def test_the_secant_condition_holds_in_any_units(seed: int) -> None:
    rng = np.random.default_rng(seed)
    before, slopes = rng.standard_normal(9), rng.standard_normal((9, 3))
    step, after = rng.standard_normal(3), rng.standard_normal(9)
    scale, units = rng.uniform(0.1, 10.0, 3), np.array([1.0, 1e-6, 1e4])
    spectrum = spectrum_of((1, 9))
    plain = Linear(spectrum, {"y": before}, {"y": slopes.copy()})
    plain = plain.updated(step, {"y": after}, scale)
    np.testing.assert_allclose(plain.slopes["y"] @ step, after - before, atol=1e-9)
    # With x in other units, slopes change by 1 / unit and weights by 1 / unit^2.
    rescaled = Linear(spectrum, {"y": before}, {"y": slopes / units})
    rescaled = rescaled.updated(step * units, {"y": after}, scale / units**2)
    np.testing.assert_allclose(
        rescaled.slopes["y"] * units, plain.slopes["y"], rtol=1e-6, atol=1e-9
    )


def test_a_descent_passes_through_the_fits_of_every_length() -> None:
    rng = np.random.default_rng(3)
    subject = Quadratic(rng.standard_normal((12, 4)), rng.standard_normal(12), 9.0, cubic=0.05)
    start = np.full(4, 2.0)
    passed = list(descent(cast(Problem, subject), start))
    assert len(passed) > 3
    assert passed[-1].converged
    for iterations, expected in enumerate(passed, start=1):
        found = fit(cast(Problem, subject), start, iterations=iterations)
        np.testing.assert_array_equal(found.x, expected.x)
        assert (found.cost, found.iterations) == (expected.cost, expected.iterations)
    costs = [each.cost for each in passed]
    assert costs == sorted(costs, reverse=True)


def test_of_several_starts_only_the_best_go_on() -> None:
    rng = np.random.default_rng(4)
    subject = Quadratic(rng.standard_normal((12, 4)), rng.standard_normal(12), 9.0, cubic=0.05)
    problem = cast(Problem, subject)
    starts = [np.full(4, size) for size in (8.0, 0.5, 1.0, 6.0)]
    taken = [0] * len(starts)

    def counted(number: int) -> Iterator[Fit]:
        for each in descent(problem, starts[number]):
            taken[number] += 1
            yield each

    best = best_of([counted(number) for number in range(4)], iterations=3, kept=2)
    first_costs = [fit(problem, start, iterations=1).cost for start in starts]
    kept = sorted(np.argsort(first_costs)[:2])
    assert [number for number in range(4) if taken[number] > 1] == kept
    assert max(taken) <= 3
    assert best.cost == min(fit(problem, starts[number], iterations=3).cost for number in kept)
