# SPDX-License-Identifier: MIT
"""One-step prediction and free run: against a plain loop and another library."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_truth import A16, B16, model16

from ehsid.harness.models.identification import (
    ArxModel,
    ArxOrders,
    IoData,
    fit_arx,
    fit_percent,
    predict_one_step,
    simulate,
)


def given_model(
    a: list[float], b: list[float], nk: int, offset: float | None = None, **means: float
) -> ArxModel:
    orders = ArxOrders(len(a), len(b), nk, offset is not None)
    theta = np.array([*a, *b, *([] if offset is None else [offset])])
    return ArxModel(orders, theta, np.zeros((theta.size,) * 2), 0.0, 0.0, 0, **means)


def loop(model: ArxModel, data: IoData, skip: int, free: bool) -> list[float]:
    """The difference equation, sample by sample, in centred signals."""
    u, y = data.u - model.u_mean, data.y - model.y_mean
    result = []
    for segment in data.segments:
        past = y.copy()
        for k in range(segment.start + skip, segment.stop):
            value = model.offset
            value -= sum(model.a[i] * past[k - 1 - i] for i in range(model.orders.na))
            value += sum(model.b[i] * u[k - model.orders.nk - i] for i in range(model.orders.nb))
            result.append(value + model.y_mean)
            if free:
                past[k] = value
    return result


COEFFICIENTS = st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=3)  # stable: |a| sums below 1


@given(
    a=COEFFICIENTS,
    b=st.lists(st.floats(-2, 2), min_size=1, max_size=3),
    nk=st.integers(0, 4),
    offset=st.none() | st.floats(-1, 1),
    u_mean=st.floats(-1, 1),
    y_mean=st.floats(-1, 1),
    more=st.integers(0, 3),
    seed=st.integers(0, 2**32 - 1),
)
def test_both_predictions_follow_the_difference_equation(
    a: list[float], b: list[float], nk: int, offset: float | None, u_mean: float, y_mean: float,
    more: int, seed: int,
) -> None:  # fmt: skip
    model = given_model(a, b, nk, offset, u_mean=u_mean, y_mean=y_mean)
    u, y = np.random.default_rng(seed).normal(size=(2, 60))
    data = IoData.from_arrays(u, y, segments=[slice(0, 25), slice(30, 60)])
    skip = model.orders.n_history + more
    for predict, free in ((predict_one_step, False), (simulate, True)):
        prediction = predict(model, data, skip=skip)
        # Sums of ten terms below 10, and a stable recursion with gain below 1 / (1 - 0.9).
        np.testing.assert_allclose(
            prediction.predicted, loop(model, data, skip, free), rtol=0, atol=1e-12
        )
        np.testing.assert_array_equal(prediction.measured, y[prediction.index])
        np.testing.assert_array_equal(
            prediction.residual, prediction.measured - prediction.predicted
        )
    assert [prediction.index[run][0] for run in prediction.runs] == [skip, 30 + skip]


def test_the_free_run_is_that_of_python_control() -> None:
    u = np.random.default_rng(1).normal(size=200)
    u[:5] = 0.0  # both start from rest
    system = control.TransferFunction(B16, np.concatenate(([1.0], A16)), 1.0)
    expected = control.forced_response(system, np.arange(200.0), u).outputs
    data = IoData.from_arrays(u, np.zeros(200))
    free = simulate(given_model(A16.tolist(), B16.tolist(), 1), data)
    # Theirs runs in state space; poles inside 0.97 keep rounding at some hundred eps.
    np.testing.assert_allclose(free.predicted, expected[free.index], rtol=0, atol=1e-11)


def test_a_run_from_measured_values_starts_where_the_measurement_is() -> None:
    u, y = model16(seed=2, n=300, noise=0.0)
    data = IoData.from_arrays(u, y, segments=[slice(100, 200)])
    free = simulate(given_model(A16.tolist(), B16.tolist(), 1), data)
    np.testing.assert_allclose(free.predicted, y[103:200], atol=1e-11)
    assert fit_percent(free.measured, free.predicted) == pytest.approx(100.0, abs=1e-9)


def test_an_unstable_free_run_overflows_without_a_warning() -> None:
    u, y = model16(seed=3, n=3000)
    for offset in (None, -1.0):
        free = simulate(given_model([-2.0], [1.0], 1, offset), IoData.from_arrays(u, y))
        assert fit_percent(free.measured, free.predicted) == -np.inf


def test_one_step_fit_is_not_simulation_fit() -> None:
    """Fast sampling: the last output alone predicts the next, whatever the model knows."""
    rng = np.random.default_rng(4)
    y = np.cumsum(rng.normal(size=4000))
    data = IoData.from_arrays(rng.normal(size=4000), y)
    model = fit_arx(data, ArxOrders(1, 1))
    ahead, free = predict_one_step(model, data), simulate(model, data)
    assert fit_percent(ahead.measured, ahead.predicted) > 90.0
    assert fit_percent(free.measured, free.predicted) < 30.0
