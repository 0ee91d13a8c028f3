# SPDX-License-Identifier: MIT
"""estimate(): every figure of a replay recomputed with numpy, on model (16) and a real record."""

import json
from dataclasses import replace

import model16
import numpy as np
import numpy.typing as npt
import policies
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

import ehsid
from ehsid.harness.models.estimation import EstimationResult, estimate
from ehsid.harness.models.identification import ArxOrders, IdentificationError, IoData, fit_arx
from ehsid.harness.records import read_record

FloatArray = npt.NDArray[np.float64]
CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"
LEAST_SQUARES = ehsid.Constant(1.0)


def crane() -> IoData:
    record = read_record(CRANE, columns=("valve_opening", "oil_pressure"))
    return IoData.from_record(record, "valve_opening", "oil_pressure")


def centred(data: IoData) -> tuple[list[FloatArray], list[FloatArray], FloatArray, FloatArray]:
    """Segments of u and y less the means of the record, and all samples of the segments."""
    u = np.concatenate([data.u[s] for s in data.segments])
    y = np.concatenate([data.y[s] for s in data.segments])
    parts_u = [data.u[s] - u.mean() for s in data.segments]
    return parts_u, [data.y[s] - y.mean() for s in data.segments], u, y


def batch(data: IoData, orders: ArxOrders) -> tuple[FloatArray, FloatArray, FloatArray]:
    """theta, rows and right side of the equations, with P0 = 1e6 I in scaled units as n more."""
    parts_u, parts_y, u, y = centred(data)
    rows = [
        model16.regressors(*part, orders.na, orders.nb, orders.nk, orders.offset)
        for part in zip(parts_u, parts_y, strict=True)
    ]
    phi, right = np.concatenate([r[0] for r in rows]), np.concatenate([r[1] for r in rows])
    unit = np.array([1.0] * orders.na + [y.std() / u.std()] * orders.nb + [y.std()] * orders.offset)
    prior = 1e-3 * np.diag(y.std() / unit)
    phi, right = np.vstack((prior, phi)), np.concatenate((np.zeros(unit.size), right))
    return np.linalg.lstsq(phi, right, rcond=None)[0], phi, right


def free_run_fit(data: IoData, orders: ArxOrders, theta: FloatArray) -> float:
    """Fit of the model on its own outputs, started from measured ones in each segment.

    With a constant term the model is of the signals as they are.
    """
    parts_u, parts_y, _, _ = centred(data)
    if orders.offset:
        parts_u, parts_y = ([x[s] for s in data.segments] for x in (data.u, data.y))
    measured, predicted = [], []
    for u, y in zip(parts_u, parts_y, strict=True):
        start = max(orders.na, orders.nk + orders.nb - 1)
        free = y.copy()
        for k in range(start, u.size):
            past = [-free[k - i] for i in range(1, orders.na + 1)]
            commands = [u[k - orders.nk - i] for i in range(orders.nb)]
            free[k] = np.dot(past + commands + [1.0] * orders.offset, theta)
        measured.append(y[start:])
        predicted.append(free[start:])
    return fit(np.concatenate(measured), np.concatenate(predicted))


def fit(measured: FloatArray, predicted: FloatArray) -> float:
    spread = np.sqrt(np.sum((measured - measured.mean()) ** 2))
    return float(100.0 * (1.0 - np.sqrt(np.sum((measured - predicted) ** 2)) / spread))


def check_figures(result: EstimationResult, data: IoData, orders: ArxOrders) -> None:
    """Figures of the result from its paths and the data alone."""
    _, _, _, y = centred(data)
    n = orders.n_parameters
    assert result.theta_path.shape == result.deviation_path.shape == (y.size, n)
    assert result.innovation.shape == result.forgetting_factor.shape == (y.size,)
    assert result.status.shape == (y.size,)
    np.testing.assert_array_equal(result.theta_path[-1], result.theta)
    np.testing.assert_array_equal(result.deviation_path[-1], result.standard_deviation)
    codes, counts = np.unique(result.status, return_counts=True)
    count = dict(zip(codes.tolist(), counts.tolist(), strict=True))
    filling = len(data.segments) * max(orders.na, orders.nk + orders.nb - 1)
    assert count.get(ehsid.Status.filling) == filling
    assert count.get(ehsid.Status.no_information, 0) == result.skipped
    assert count.get(ehsid.Status.reset, 0) == result.resets
    nothing = result.status == ehsid.Status.filling
    np.testing.assert_array_equal(np.isnan(result.innovation), nothing)
    np.testing.assert_array_equal(np.isnan(result.forgetting_factor), nothing)
    # Behind ten equations a parameter.
    assert result.n_start == 10 * n
    used = np.flatnonzero(~nothing)[10 * n :]
    error = result.innovation[used]
    assert result.rmse == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    assert result.one_step_fit_percent == pytest.approx(fit(y[used], y[used] - error), rel=1e-12)
    free = free_run_fit(data, orders, result.theta)
    # Two ways to run the same recursion; the poles of model (16) multiply rounding by 1e4 at most.
    assert result.simulation_fit_percent == pytest.approx(free, rel=1e-9)


@pytest.mark.slow
@given(
    orders=st.builds(
        ArxOrders, st.integers(1, 4), st.integers(1, 4), st.integers(0, 5), st.booleans()
    ),
    seed=st.integers(0, 1000),
    cut=st.integers(400, 700),
)
def test_least_squares_and_every_figure_on_model_16(orders: ArxOrders, seed: int, cut: int) -> None:
    u, y = model16.signals(seed, 1100)
    gap = [slice(0, cut), slice(cut + 20, 1100)]
    data = IoData.from_arrays(3.0 + 2.0 * u, 0.5 + 0.01 * y, segments=gap)
    result = estimate(data, orders, forgetting=LEAST_SQUARES, reset=False, dtype="float64")
    check_figures(result, data, orders)
    theta, phi, right = batch(data, orders)
    # 1000 steps of eps, carried by the condition number of the normal equations in scaled units.
    scale = np.sqrt(np.mean(phi**2, axis=0))
    tolerance = 2.2e-16 * 1000.0 * np.linalg.cond(phi / scale) ** 2
    largest = np.abs(theta * scale).max()
    # The constant of the signals as they are, from that of the signals less their means.
    to_raw = np.eye(theta.size)
    if orders.offset:
        _, _, u, y = centred(data)
        to_raw[-1, :-1] = [y.mean()] * orders.na + [-u.mean()] * orders.nb
    raw = to_raw @ theta
    raw[-1] += to_raw[-1, 0] if orders.offset else 0.0
    room = tolerance * largest * (np.abs(to_raw) @ (1.0 / scale))
    assert (np.abs(result.theta - raw) <= room).all()
    # sigma^2 P with N - n degrees of freedom; the start values count among the residuals, since
    # sum epsilon^2 / (1 + phi' P phi) = |y - phi theta|^2 + theta' P0^-1 theta.
    variance = np.sum((right - phi @ theta) ** 2) / (right.size - 2 * theta.size)
    inverse = np.linalg.inv(phi.T @ phi)
    square = np.diag(to_raw @ inverse @ to_raw.T)
    deviation = np.sqrt(variance * square)
    cancels = np.diag(np.abs(to_raw) @ np.abs(inverse) @ np.abs(to_raw.T)) / square
    # The orders of the test are often not those of the model: then the residuals are not white.
    inflation = 1.0 if result.residuals_white else np.sqrt(1.0 + result.whiteness)
    missed = np.abs(result.standard_deviation / (inflation * deviation) - 1.0)
    assert (missed <= tolerance * cancels).all()
    assert result.resets == 0


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_the_offset_is_the_constant_of_the_signals_as_they_are(dtype: str) -> None:
    """A lag of ten samples about u = 1, y = 5 (TimeSeriesAnalysis, issue 26), without noise."""
    u = 1.0 + np.sign(np.random.default_rng(3).normal(size=420))
    a, y = np.exp(-0.1), [5.0]
    for one in u[:-1]:
        y.append(5.0 + a * (y[-1] - 5.0) + (1.0 - a) * (one - 1.0))
    data = IoData.from_arrays(u, np.array(y))
    orders = ArxOrders(1, 1, 1, offset=True)
    result = estimate(data, orders, forgetting=LEAST_SQUARES, dtype=dtype)
    # 4 (1 - a), of 420 sums with rounding errors of the signals' size.
    assert result.theta[-1] == pytest.approx(4.0 * (1.0 - a), rel=0.0, abs=2e-5)
    plain = result.to_dict()
    assert plain["parameters"]["offset"]["value"] == result.theta[-1]
    assert (plain["u_mean"], plain["y_mean"]) == (0.0, 0.0)
    without = estimate(data, ArxOrders(1, 1, 1), forgetting=LEAST_SQUARES).to_dict()
    assert (without["u_mean"], without["y_mean"]) == pytest.approx((u.mean(), np.mean(y)))


@pytest.mark.parametrize("seed", range(3))
def test_offsets_agree_with_identification_within_their_deviations(seed: int) -> None:
    """Far from zero the coefficients of an integrating plant cancel: P is needed in double."""
    u, y = model16.signals(seed, 3000, noise=0.01)
    data = IoData.from_arrays(3.0 + u, 40.0 + y)
    orders = ArxOrders(3, 3, 1, offset=True)
    model = fit_arx(data, orders)
    result = estimate(data, orders, forgetting=LEAST_SQUARES, reset=False)
    assert result.residuals_white
    assert result.standard_deviation[-1] == pytest.approx(model.standard_deviations[-1], rel=0.05)
    assert abs(result.theta[-1] - model.offset) < 0.2 * model.standard_deviations[-1]


@pytest.mark.parametrize("name", policies.NAMES)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_every_figure_on_the_crane(name: str, dtype: str) -> None:
    data, orders = crane(), ArxOrders(3, 3, 1)
    result = estimate(data, orders, forgetting=policies.PAIRS[name].compiled, dtype=dtype)
    check_figures(result, data, orders)
    assert result.status.size == 1024
    in_single = np.array_equal(result.theta, result.theta.astype(np.float32))
    assert in_single == (dtype == "float32")
    assert result.forgetting == repr(policies.PAIRS[name].compiled)
    plain = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert plain["rmse"] == result.rmse
    half = 1.959963984540054 * result.standard_deviation  # norm.ppf(0.975)
    for i, entry in enumerate(plain["parameters"].values()):
        assert entry["value"] == result.theta[i]
        assert entry["ci95"] == pytest.approx([entry["value"] - half[i], entry["value"] + half[i]])


def test_a_diverging_simulation_is_null_in_json() -> None:
    data = IoData.from_arrays(*model16.signals(2, 500))
    result = estimate(data, ArxOrders(3, 3, 1), forgetting=LEAST_SQUARES)
    unstable = replace(result, simulation_fit_percent=-np.inf).to_dict()
    assert unstable["simulation_fit_percent"] is None
    json.dumps(unstable, allow_nan=False)


@pytest.mark.parametrize(
    ("n", "u", "y", "orders", "kind", "words"),
    [
        (500, 1.0, None, (3, 3), IdentificationError, "u is constant"),
        (500, None, 2.0, (3, 3), IdentificationError, "y is constant"),
        (123, None, None, (3, 3), IdentificationError, "123 samples leave 120 equations for 6"),
        (500, None, None, (7, 1), ValueError, "na must be in 1..6, got 7"),
    ],
)
def test_bad_records_and_orders_are_named(
    n: int,
    u: float | None,
    y: float | None,
    orders: tuple[int, int],
    kind: type[Exception],
    words: str,
) -> None:
    record_u, record_y = model16.signals(4, n)
    data = IoData.from_arrays(
        record_u if u is None else np.full(n, u), record_y if y is None else np.full(n, y)
    )
    with pytest.raises(kind, match=words):
        estimate(data, ArxOrders(*orders), forgetting=LEAST_SQUARES)


def test_another_method_is_right_with_a_noisy_sensor() -> None:
    rng = np.random.default_rng(8)
    u, x = model16.signals(8, 4000, noise=0.0)
    data = IoData(u, x + 0.05 * rng.normal(size=x.size), (slice(0, u.size),))
    forgetting = ehsid.Exponential(lambda0=0.995, lambda_initial=0.98)
    plain = estimate(data, ArxOrders(3, 3, 1, offset=True), forgetting=forgetting)
    other = estimate(data, ArxOrders(3, 3, 1, offset=True), forgetting=forgetting, method="riv")
    assert (plain.method, other.to_dict()["method"]) == ("rls", "riv")
    assert (plain.residuals_white, other.residuals_white) == (False, True)
    # What the deviations would be, were the residuals white.
    deviation = plain.standard_deviation[:6] / np.sqrt(1.0 + plain.whiteness)
    assert np.max(np.abs(plain.theta[:6] - model16.THETA) / deviation) > 10.0
    assert np.max(np.abs(other.theta[:6] - model16.THETA) / other.standard_deviation[:6]) < 4.0
    assert other.simulation_fit_percent > 95.0
