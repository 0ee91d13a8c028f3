# SPDX-License-Identifier: MIT
"""Means, lines and scales: against scipy.signal.detrend, and there and back."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_truth import model16

from ehsid.harness.models.identification import (
    ArxOrders,
    IdentificationError,
    IoData,
    Preprocessing,
    fit_arx,
    identify,
    preprocess,
    simulate,
)

TRENDS = ("none", "mean", "linear")


def walk(seed: int, n: int = 300, level: float = 0.0, slope: float = 0.0) -> IoData:
    rng = np.random.default_rng(seed)
    y = np.cumsum(rng.normal(size=n)) + level + slope * np.arange(n)
    return IoData.from_arrays(level + rng.normal(size=n), y)


@given(
    seed=st.integers(0, 2**32 - 1),
    level=st.floats(-1e3, 1e3),
    slope=st.floats(-1.0, 1.0),
    split=st.floats(0.2, 0.8),
    kind=st.sampled_from([("mean", "constant"), ("linear", "linear")]),
)
def test_the_estimation_part_is_that_of_scipy(
    seed: int, level: float, slope: float, split: float, kind: tuple[str, str]
) -> None:
    data = walk(seed, level=level, slope=slope)
    trend, scipys = kind
    done = preprocess(data, Preprocessing(trend=trend, outliers=False), split=split)
    n = round(split * 300)
    for ours, recorded in ((done.data.u, data.u), (done.data.y, data.y)):
        # Rounding: 300 sums of numbers below 2000.
        expected = scipy.signal.detrend(recorded[:n], type=scipys)
        np.testing.assert_allclose(ours[:n], expected, atol=1e-9)


@given(seed=st.integers(0, 2**32 - 1), slope=st.floats(-1.0, 1.0))
def test_the_line_is_that_of_linregress_and_goes_on(seed: int, slope: float) -> None:
    data = walk(seed, slope=slope)
    done = preprocess(data, Preprocessing(trend="linear", outliers=False))
    k = np.arange(300)
    line = scipy.stats.linregress(k[:150], data.y[:150])
    assert done.y.slope == pytest.approx(line.slope, abs=1e-12)
    np.testing.assert_allclose(done.data.y, data.y - line.intercept - line.slope * k, atol=1e-9)


@given(
    seed=st.integers(0, 2**32 - 1),
    trend=st.sampled_from(TRENDS),
    scaling=st.booleans(),
    level=st.floats(-1e3, 1e3),
)
def test_there_and_back(seed: int, trend: str, scaling: bool, level: float) -> None:
    data = walk(seed, level=level)
    done = preprocess(data, Preprocessing(trend=trend, outliers=False, scaling=scaling))
    k = np.arange(300)
    np.testing.assert_allclose(done.u.back(k, done.data.u), data.u, atol=1e-9)
    np.testing.assert_allclose(done.y.back(k, done.data.y), data.y, atol=1e-9)
    if scaling:
        spread = np.std(done.data.y[:150] - np.polyval(np.polyfit(k[:150], data.y[:150], 0), 0))
        assert spread > 0.0
        expected = {"none": np.std(data.y[:150]), "mean": np.std(data.y[:150])}
        if trend in expected:
            assert done.y.scale == pytest.approx(expected[trend], rel=1e-12)


def test_validation_data_have_no_say() -> None:
    data = walk(1)
    other = replace(data, u=data.u.copy(), y=data.y.copy())
    other.u[150:] += 5.0
    other.y[150:] *= -3.0
    asked = Preprocessing(trend="linear", outliers=False, scaling=True)
    one, two = preprocess(data, asked), preprocess(other, asked)
    assert one.u == two.u
    assert one.y == two.y


def test_one_mean_for_all_segments_and_none_from_the_gap() -> None:
    u, y = model16(seed=2, n=400)
    y[100:120] = 1e6
    data = IoData.from_arrays(u, y, segments=[slice(0, 100), slice(120, 400)])
    done = preprocess(data, Preprocessing(trend="mean", outliers=False))
    # 380 samples, 190 of them to estimate: 100 before the gap and 90 behind it.
    assert done.y.mean == pytest.approx(np.mean(np.r_[y[:100], y[120:210]]))
    assert done.y.level == done.y.mean


@pytest.mark.parametrize("scaling", [False, True])
@pytest.mark.parametrize("trend", ["none", "mean"])
@pytest.mark.parametrize("offset", [False, True])
def test_a_model_goes_back_to_the_units_of_the_record(
    scaling: bool, trend: str, offset: bool
) -> None:
    u, y = model16(seed=3, n=600, offset=0.2)
    data = IoData.from_arrays(1e-2 * u + 0.3, 1e3 * y + 50.0)
    done = preprocess(data, Preprocessing(trend=trend, outliers=False, scaling=scaling))
    half = done.data.split(0.5)[0]
    ours = done.restore_model(fit_arx(half, ArxOrders(3, 3, 1, offset)))
    # Least squares in the units of the record, means by fit_arx itself.
    direct = fit_arx(data.split(0.5)[0], ArxOrders(3, 3, 1, offset), remove_means=trend == "mean")
    np.testing.assert_allclose(ours.theta, direct.theta, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(ours.covariance, direct.covariance, rtol=1e-6, atol=1e-9)
    assert ours.noise_variance == pytest.approx(direct.noise_variance)
    assert (ours.u_mean, ours.y_mean) == pytest.approx((direct.u_mean, direct.y_mean))
    # Free run: in the units of the record, and back from those of the pre-processed data.
    model = fit_arx(half, ArxOrders(3, 3, 1, offset))
    np.testing.assert_allclose(
        simulate(ours, data).predicted,
        done.restore(simulate(model, done.data)).predicted,
        rtol=1e-6,
    )


def test_means_change_nothing_where_there_is_a_constant_term() -> None:
    """What `consequence` says, to rounding; and that without the term they do."""
    u, y = model16(seed=10, n=800, noise=0.01)
    data = IoData.from_arrays(u, y)
    fits = {}
    for trend in ("none", "mean"):
        for offset in (True, False):
            done = preprocess(data, Preprocessing(trend=trend, outliers=False))
            result = identify(done.data, orders=[3], delays=[1], offset=offset)
            fits[trend, offset] = (result.chosen.model.theta[:6], result.chosen)
    np.testing.assert_allclose(fits["none", True][0], fits["mean", True][0], rtol=1e-7)
    with_term = fits["none", True][1].simulation_fit_percent
    assert with_term > 50.0
    assert fits["mean", True][1].simulation_fit_percent == pytest.approx(with_term, rel=1e-6)
    assert fits["mean", False][1].simulation_fit_percent < 0.0


@settings(max_examples=20)
@given(level=st.floats(-1e6, 1e6), trend=st.sampled_from(TRENDS), scaling=st.booleans())
def test_a_constant_stays_one(level: float, trend: str, scaling: bool) -> None:
    data = IoData.from_arrays(np.full(100, level), np.arange(100.0))
    done = preprocess(data, Preprocessing(trend=trend, outliers=False, scaling=scaling))
    assert np.ptp(done.data.u) == 0.0
    assert done.u.scale == 1.0


def test_the_input_keeps_its_spikes_and_the_report_becomes_json() -> None:
    u, y = model16(seed=5, n=600, noise=0.01)
    u[100] = 1e3
    y[200] += 1e2
    done = preprocess(IoData.from_arrays(u, y))
    np.testing.assert_array_equal(done.data.u, u)
    assert done.outliers is not None
    assert 200 in done.outliers.positions
    plain = json.loads(json.dumps(done.to_dict(), allow_nan=False))
    assert "data" not in plain
    assert plain["settings"]["trend"] == "none"


def test_bad_settings_are_said() -> None:
    with pytest.raises(IdentificationError, match="expected one of none, mean, linear"):
        Preprocessing(trend="quadratic")  # type: ignore[arg-type]
    with pytest.raises(IdentificationError, match="between 0 and 1"):
        preprocess(walk(6), split=0.0)
