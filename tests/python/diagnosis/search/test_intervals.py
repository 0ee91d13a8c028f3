# SPDX-License-Identifier: MIT
"""Intervals against the cluster-robust covariance of statsmodels."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import pytest
import statsmodels.api as sm

from ehsid.harness.diagnosis.model.parameters import Parameter
from ehsid.harness.diagnosis.model.problem import Problem, Step
from ehsid.harness.diagnosis.search.intervals import deviations, in_deviations, interval
from ehsid.harness.diagnosis.search.model_error import MODEL_ERROR

WINDOWS, SAMPLES = 40, 25


class Linear:
    """Errors X b - y in windows, without priors: what `deviations` needs of a problem."""

    def __init__(self, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> None:
        self.x, self.y = x, y
        self.low = np.full(x.shape[1], -np.inf)
        self.high = np.full(x.shape[1], np.inf)

    def window_gradients(self, b: npt.NDArray[np.float64]) -> tuple[Step, npt.NDArray[np.float64]]:
        error = self.x @ b - self.y
        by_window = (self.x * error[:, np.newaxis]).reshape(WINDOWS, SAMPLES, -1).sum(axis=1)
        return Step(0.0, by_window.sum(axis=0), self.x.T @ self.x), by_window

    def information(self) -> npt.NDArray[np.float64]:
        return np.zeros(self.x.shape[1])


def test_deviations_are_those_of_clustered_errors() -> None:
    rng = np.random.default_rng(5)
    x = rng.normal(size=(WINDOWS * SAMPLES, 3))
    # The errors are correlated within a window, more in some windows than in others.
    size = rng.uniform(0.1, 2.0, WINDOWS)
    noise = np.repeat(size * rng.normal(size=WINDOWS), SAMPLES) * x[:, 0]
    y = x @ [1.0, -2.0, 0.5] + noise + rng.normal(size=x.shape[0])
    fitted = sm.OLS(y, x).fit()
    groups = np.repeat(np.arange(WINDOWS), SAMPLES)
    robust = fitted.get_robustcov_results("cluster", groups=groups, use_correction=False)
    problem = cast(Problem, cast(Any, Linear(x, y)))
    scatter = deviations(problem, fitted.params)
    # The same formula, in floating point.
    np.testing.assert_allclose(scatter, robust.bse, rtol=1e-9)
    # The plain Gauss-Newton deviation would be much too small where errors are correlated.
    assert scatter[0] > 2.0 * fitted.bse[0]


def test_a_value_at_its_bound_has_no_scatter() -> None:
    rng = np.random.default_rng(6)
    x = rng.normal(size=(WINDOWS * SAMPLES, 2))
    problem = Linear(x, x @ [1.0, -1.0] + rng.normal(size=x.shape[0]))
    problem.low[1] = 0.0
    scatter = deviations(cast(Problem, cast(Any, problem)), np.array([1.0, 0.0]))
    assert scatter[1] == 0.0
    assert scatter[0] > 0.0


def test_a_value_on_which_nothing_depends_is_not_known() -> None:
    rng = np.random.default_rng(7)
    x = rng.normal(size=(WINDOWS * SAMPLES, 3))
    x[:, 1] = 0.0
    y = x @ [1.0, 0.0, 0.5] + rng.normal(size=x.shape[0])
    scatter = deviations(cast(Problem, cast(Any, Linear(x, y))), np.array([1.0, 0.0, 0.5]))
    assert scatter[1] == math.inf
    # The others are known as well as without it.
    alone = Linear(x[:, [0, 2]], y)
    expected = deviations(cast(Problem, cast(Any, alone)), np.array([1.0, 0.5]))
    np.testing.assert_allclose(scatter[[0, 2]], expected, rtol=1e-12)
    # The interval is then the whole range.
    parameter = Parameter("effects.a.b", False, 0.0, math.inf, -1.0, 2.0)
    estimate = interval(parameter, 0.3, scatter[1], WINDOWS)
    assert (estimate.low, estimate.value, estimate.high) == (-1.0, 0.3, 2.0)
    assert in_deviations(parameter, 0.3, scatter[1])[1] == 0.0


@pytest.mark.parametrize("logarithmic", [False, True])
def test_an_interval_holds_its_value_and_stays_inside_the_bounds(logarithmic: bool) -> None:
    parameter = Parameter("effects.a.b", logarithmic, 0.0, math.inf, -1.0, 2.0)
    for x in (-1.0, 0.3, 2.0):
        estimate = interval(parameter, x, 0.5, 40)
        assert estimate.low <= estimate.value <= estimate.high
        assert estimate.low >= parameter.value(parameter.low)
        assert estimate.high <= parameter.value(parameter.high)


def test_an_interval_without_scatter_is_the_error_of_the_model() -> None:
    parameter = Parameter("effects.a.b", True, 0.0, math.inf, -9.0, 9.0)
    estimate = interval(parameter, 1.0, 0.0, 10**6, MODEL_ERROR[True])
    # 1.645, the 95 % point of the normal distribution.
    assert math.log(estimate.high / estimate.value) == pytest.approx(
        1.6449 * MODEL_ERROR[True], rel=1e-3
    )


def test_moves_count_in_deviations_of_prior_and_fit() -> None:
    parameter = Parameter("load.mass_kg", True, 1.0, 0.1, 0.0, 2.0)
    assert in_deviations(parameter, 1.2, 0.05) == pytest.approx((2.0, 4.0))
    assert in_deviations(parameter, 1.2, 0.0)[1] == math.inf
