# SPDX-License-Identifier: MIT
"""The optimiser alone, on costs whose minimum scipy knows."""

from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from ehsid.harness.gap import Problem, fit
from ehsid.harness.gap.problem import Step


class Quadratic:
    """|A x - b|^2 / 2 in a box, with the two calls that a fit makes."""

    def __init__(self, a: np.ndarray, b: np.ndarray, half: float) -> None:
        self.a, self.b = a, b
        self.low, self.high = np.full(a.shape[1], -half), np.full(a.shape[1], half)

    def cost(self, x: np.ndarray) -> float:
        return float(0.5 * np.sum((self.a @ x - self.b) ** 2))

    def step(self, x: np.ndarray) -> Step:
        error = self.a @ x - self.b
        return Step(self.cost(x), self.a.T @ error, self.a.T @ self.a)


@given(seed=st.integers(0, 500), half=st.floats(0.05, 5.0))
def test_minimum_in_a_box_is_that_of_scipy(seed: int, half: float) -> None:
    rng = np.random.default_rng(seed)
    # Correlated columns: a step that ignores which parameters are held at a bound goes astray.
    a = rng.standard_normal((12, 4)) @ (np.eye(4) + 2.0 * rng.standard_normal((4, 4)))
    subject = Quadratic(a, 3.0 * rng.standard_normal(12), half)
    found = fit(cast(Problem, subject), rng.uniform(-half, half, 4), iterations=200)
    expected = lsq_linear(a, subject.b, (-half, half), tol=1e-14)
    assert np.all(np.abs(found.x) <= half)
    # A fit ends where a step gains less than 1e-3; damping leaves a few such steps.
    assert found.cost < expected.cost + 0.05 * (1.0 + expected.cost)


def test_a_start_outside_is_brought_in_and_no_step_is_worse() -> None:
    subject = Quadratic(np.eye(2), np.array([10.0, 0.0]), 1.0)
    found = fit(cast(Problem, subject), np.array([-50.0, 50.0]))
    np.testing.assert_allclose(found.x, [1.0, 0.0], atol=0.05)
    assert found.converged
    assert found.cost <= subject.cost(np.array([-1.0, 1.0]))


def test_iterations_are_kept() -> None:
    subject = Quadratic(np.diag([1.0, 1e3]), np.array([1.0, 1.0]), 5.0)
    found = fit(cast(Problem, subject), np.array([4.0, 4.0]), iterations=1)
    assert found.iterations == 1
    assert not found.converged
    assert found.cost == pytest.approx(subject.cost(found.x))
