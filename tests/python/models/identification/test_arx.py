# SPDX-License-Identifier: MIT
"""Estimation of ARX models: against numpy and statsmodels, on known truth, and by properties."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest
import scipy.signal
import scipy.stats
import statsmodels.api as sm
from hypothesis import given
from hypothesis import strategies as st
from identification_truth import arx_output, model16

from ehsid.harness.models.identification import (
    ArxOrders,
    IdentificationError,
    IoData,
    TooFewSamplesError,
    UnexcitedError,
    fit_arx,
    fit_percent,
    predict_one_step,
    regression,
)
from ehsid.harness.records import make_record

EPS = np.finfo(np.float64).eps
STRUCTURES = st.builds(
    ArxOrders,
    na=st.integers(1, 4),
    nb=st.integers(1, 4),
    nk=st.integers(0, 5),
    offset=st.booleans(),
)


def rounding(phi: np.ndarray) -> float:
    """Relative error of a backward stable least-squares solution: n eps times the condition.

    The solution of a problem with small residuals has an error of about eps cond(phi), phi with
    unit columns (Higham, Accuracy and Stability of Numerical Algorithms, ch. 20); n rows bound the
    constant of the factorisation.
    """
    return float(phi.shape[0] * EPS * np.linalg.cond(phi / np.linalg.norm(phi, axis=0)))


@given(orders=STRUCTURES, skip=st.integers(0, 4), seed=st.integers(0, 2**32 - 1))
def test_the_regressor_is_that_of_equation_8(orders: ArxOrders, skip: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    u, y = rng.normal(size=(2, 40))
    data = IoData.from_arrays(u, y, segments=[slice(0, 22), slice(22, 25), slice(25, 40)])
    skip += orders.n_history
    if skip >= 22:
        return
    rows = regression(data, orders, skip=skip)

    expected_k, expected_phi = [], []
    for start, stop in ((0, 22), (22, 25), (25, 40)):
        for k in range(start + skip, stop):
            phi = [-y[k - i] for i in range(1, orders.na + 1)]
            phi += [u[k - orders.nk - i] for i in range(orders.nb)]
            expected_phi.append(phi + ([1.0] if orders.offset else []))
            expected_k.append(k)
    np.testing.assert_array_equal(rows.index, expected_k)
    np.testing.assert_array_equal(rows.phi, expected_phi)
    np.testing.assert_array_equal(rows.y, y[expected_k])
    for run in rows.runs:
        assert (np.diff(rows.index[run]) == 1).all()
    assert sum(run.stop - run.start for run in rows.runs) == rows.y.size


@given(orders=STRUCTURES, seed=st.integers(0, 2**32 - 1), scale=st.floats(1e-6, 1e6))
def test_the_estimate_is_that_of_lstsq(orders: ArxOrders, seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    u = scale * rng.normal(size=300)
    y = scipy.signal.lfilter([0.0, 1.0, 0.5], [1.0, -1.2, 0.5], u / scale) + rng.normal(size=300)
    data = IoData.from_arrays(u, y)
    rows = regression(data, orders)
    # Theirs on unit columns too: with a condition of 1e6 from units alone it is the less exact.
    length = np.linalg.norm(rows.phi, axis=0)
    expected, _, _, _ = np.linalg.lstsq(rows.phi / length, rows.y)
    error = length * fit_arx(data, orders).theta - expected
    # The residual here is as large as the output: the condition then enters squared (ibid.).
    tolerance = rounding(rows.phi) * np.linalg.cond(rows.phi / length) * np.linalg.norm(rows.y)
    assert np.linalg.norm(error) <= tolerance


@pytest.mark.parametrize("offset", [False, True])
def test_covariance_intervals_and_loss_are_those_of_statsmodels_ols(offset: bool) -> None:
    u, y = model16(seed=1, n=400, offset=0.3)
    data = IoData.from_arrays(u, y)
    orders = ArxOrders(3, 2, 1, offset)
    rows = regression(data, orders)
    theirs = sm.OLS(rows.y, rows.phi).fit()
    ours = fit_arx(data, orders)
    # Both are stable; the normal matrix inverse carries the condition squared.
    tolerance = rounding(rows.phi) * np.linalg.cond(rows.phi)
    np.testing.assert_allclose(ours.theta, theirs.params, rtol=tolerance)
    np.testing.assert_allclose(ours.covariance, theirs.cov_params(), rtol=tolerance)
    np.testing.assert_allclose(ours.standard_deviations, theirs.bse, rtol=tolerance)
    low, high = ours.intervals(0.95).T  # of the normal distribution, where theirs have Student's
    np.testing.assert_allclose(0.5 * (low + high), ours.theta, rtol=1e-12)
    half = scipy.stats.norm.ppf(0.975) * theirs.bse
    np.testing.assert_allclose(0.5 * (high - low), half, rtol=tolerance)
    assert ours.noise_variance == pytest.approx(theirs.scale, rel=tolerance)
    assert ours.loss == pytest.approx(theirs.ssr / theirs.nobs, rel=tolerance)
    assert ours.n_rows == theirs.nobs


def test_segments_give_the_rows_that_do_not_reach_over_a_gap() -> None:
    u, y = model16(seed=4, n=300)
    gap = IoData.from_arrays(u, y, segments=[slice(0, 120), slice(150, 300)])
    orders = ArxOrders(3, 3, 1)
    whole = regression(IoData.from_arrays(u, y), orders)
    keep = (whole.index < 120) | (whole.index >= 153)
    expected, *_ = np.linalg.lstsq(whole.phi[keep], whole.y[keep])
    model = fit_arx(gap, orders)
    assert model.n_rows == keep.sum() == 117 + 147
    np.testing.assert_allclose(model.theta, expected, rtol=100 * rounding(whole.phi))


def test_removing_means_is_a_fit_of_the_centred_signals() -> None:
    u, y = model16(seed=5, n=400, offset=0.4)
    u += 3.0
    removed = fit_arx(IoData.from_arrays(u, y), ArxOrders(3, 3, 1), remove_means=True)
    by_hand = fit_arx(IoData.from_arrays(u - u.mean(), y - y.mean()), ArxOrders(3, 3, 1))
    np.testing.assert_array_equal(removed.theta, by_hand.theta)
    assert removed.u_mean == u.mean()
    assert removed.y_mean == y.mean()


@given(
    seed=st.integers(0, 2**32 - 1),
    u_scale=st.floats(1e-6, 1e6),
    y_scale=st.floats(1e-6, 1e6),
    means=st.booleans(),
)
def test_units_change_b_and_nothing_else(
    seed: int, u_scale: float, y_scale: float, means: bool
) -> None:
    u, y = model16(seed=seed, n=200)
    orders = ArxOrders(3, 3, 1)
    plain = IoData.from_arrays(u, y)
    scaled = IoData.from_arrays(u_scale * u, y_scale * y)
    one = fit_arx(plain, orders, remove_means=means)
    two = fit_arx(scaled, orders, remove_means=means)
    # Errors are relative to the largest parameter: the columns of the solved matrix are unit long.
    tolerance = 10 * rounding(regression(plain, orders).phi) * np.abs(one.theta).max()
    ratio = y_scale / u_scale
    np.testing.assert_allclose(two.a, one.a, rtol=0, atol=tolerance)
    np.testing.assert_allclose(two.b / ratio, one.b, rtol=0, atol=tolerance)
    assert two.loss == pytest.approx(y_scale**2 * one.loss, rel=1e-6)
    fits = [
        fit_percent(p.measured, p.predicted)
        for p in (predict_one_step(one, plain), predict_one_step(two, scaled))
    ]
    assert fits[0] == pytest.approx(fits[1], abs=1e-6)


@given(
    constant=st.just(0.0) | st.floats(1e-9, 1e3) | st.floats(-1e3, -1e-9),
    orders=st.builds(ArxOrders, na=st.integers(1, 3), nb=st.integers(1, 3), offset=st.booleans()),
    means=st.booleans(),
)
def test_a_constant_input_is_named(constant: float, orders: ArxOrders, means: bool) -> None:
    y = np.random.default_rng(6).normal(size=100)
    data = IoData.from_arrays(np.full(100, constant), y)
    zero = constant == 0.0 or means
    if orders.nb == 1 and not orders.offset and not zero:
        fit_arx(data, orders, remove_means=means)  # one gain on a constant is determined
        return
    with pytest.raises(UnexcitedError) as caught:
        fit_arx(data, orders, remove_means=means)
    assert "b1" in caught.value.parameters
    assert not any(name.startswith("a") for name in caught.value.parameters)
    assert "b1" in str(caught.value)


def test_too_high_an_order_without_noise_is_named() -> None:
    rng = np.random.default_rng(7)
    u = rng.normal(size=300)
    y = arx_output(np.array([-1.2, 0.5]), np.array([1.0, 0.3]), 1, u, np.zeros(300))
    with pytest.raises(UnexcitedError, match="order is too high") as caught:
        fit_arx(IoData.from_arrays(u, y), ArxOrders(3, 3, 1))
    # The truth one sample later, A y(k-1) = B u(k-1), binds a1..a3 to b2 and b3; b1 is free of it.
    assert caught.value.parameters == ("a1", "a2", "a3", "b2", "b3")


def test_a_single_sine_excites_two_input_parameters_only() -> None:
    k = np.arange(400)
    u = np.sin(0.3 * k)
    y = np.random.default_rng(8).normal(size=400)
    assert fit_arx(IoData.from_arrays(u, y), ArxOrders(1, 2)).n_rows == 398
    with pytest.raises(UnexcitedError, match="too few frequencies") as caught:
        fit_arx(IoData.from_arrays(u, y), ArxOrders(1, 3))
    assert caught.value.parameters == ("b1", "b2", "b3")


def test_too_few_samples_and_bad_settings() -> None:
    u, y = model16(seed=9, n=8)
    with pytest.raises(TooFewSamplesError, match="5 equations do not determine 6 parameters"):
        fit_arx(IoData.from_arrays(u, y), ArxOrders(3, 3, 1))
    with pytest.raises(TooFewSamplesError, match="more than 13 samples; the longest has 8"):
        fit_arx(IoData.from_arrays(u, y), ArxOrders(3, 3, 11))
    for bad in ((0, 1, 1), (1, 0, 1), (1, 1, -1)):
        with pytest.raises(IdentificationError, match="must be at least"):
            ArxOrders(*bad)
    with pytest.raises(IdentificationError, match="equal length"):
        IoData.from_arrays(u, y[:-1])
    with pytest.raises(IdentificationError, match="finite"):
        IoData.from_arrays(u, np.where(y == y[0], np.nan, y))
    with pytest.raises(IdentificationError, match="needs 3 samples before"):
        regression(IoData.from_arrays(u, y), ArxOrders(3, 3, 1), skip=2)


@given(
    lengths=st.lists(st.integers(1, 20), min_size=1, max_size=5),
    fraction=st.floats(0.05, 0.95),
)
def test_a_split_keeps_every_sample_once_and_in_order(lengths: list[int], fraction: float) -> None:
    edges = np.cumsum([0, *lengths]).tolist()
    segments = [slice(a, b) for a, b in pairwise(edges)]
    data = IoData.from_arrays(np.zeros(edges[-1]), np.zeros(edges[-1]), segments=segments)
    first, second = data.split(fraction)
    assert first.n_samples == round(fraction * data.n_samples)
    samples = [k for s in (*first.segments, *second.segments) for k in range(s.start, s.stop)]
    assert samples == list(range(edges[-1]))
    # No part joins what a gap had separated.
    for part in (*first.segments, *second.segments):
        assert any(s.start <= part.start and part.stop <= s.stop for s in segments)


def test_from_record_takes_segments_and_sampling_time() -> None:
    time_s = np.concatenate((np.arange(10), 15 + np.arange(10))) * 0.01
    record = make_record({"time_s": time_s, "u": np.arange(20.0), "y": np.ones(20)})
    data = IoData.from_record(record, "u", "y")
    assert data.segments == (slice(0, 10), slice(10, 20))
    assert data.dt_s == pytest.approx(0.01)
    assert (data.input_name, data.output_name) == ("u", "y")


def test_samples_whose_squares_overflow_are_refused() -> None:
    u, y = np.ones(20), np.arange(20.0)
    u[7] = -1e101
    with pytest.raises(
        IdentificationError, match=r"u: sample 7 is 1e\+101 in size.*at most 1e\+100"
    ):
        IoData.from_arrays(u, y)
    u[7] = 1e100
    assert IoData.from_arrays(u, y).u[7] == 1e100


def test_a_model_becomes_json() -> None:
    u, y = model16(seed=10, n=100)
    plain = fit_arx(IoData.from_arrays(u, y), ArxOrders(2, 2, 1, offset=True)).to_dict()
    read = json.loads(json.dumps(plain, allow_nan=False))
    assert read["names"] == ["a1", "a2", "b1", "b2", "offset"]
    assert read["orders"] == {"na": 2, "nb": 2, "nk": 1, "offset": True}
    assert len(read["theta"]) == len(read["standard_deviations"]) == 5
