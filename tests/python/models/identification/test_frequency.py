# SPDX-License-Identifier: MIT
"""Frequency response with its band: against control and by Monte Carlo."""

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
    FrequencyResponse,
    IdentificationError,
    IoData,
    agreement,
    fit_arx,
    frequency_response,
    power_band,
)
from ehsid.harness.signals.excitation import multisine

DT_S = 0.05
GRID = np.geomspace(0.02, 9.9, 60)


def response_of_16(frequency_hz: np.ndarray) -> np.ndarray:
    system = control.tf(np.r_[B16, 0.0][:3], np.r_[1.0, A16], DT_S)
    return system(np.exp(2j * np.pi * frequency_hz * DT_S))


def rounded(x: float) -> float:
    """No number so small that its products underflow."""
    return round(x, 6)


@given(
    a=st.lists(st.floats(-0.3, 0.3).map(rounded), min_size=1, max_size=3),
    b=st.lists(st.floats(-2, 2).map(rounded), min_size=1, max_size=4),
    nk=st.integers(0, 4),
    offset=st.booleans(),
)
def test_the_response_is_that_of_control(
    a: list[float], b: list[float], nk: int, offset: bool
) -> None:
    orders = ArxOrders(len(a), len(b), nk, offset)
    theta = np.array([*a, *b, *([5.0] if offset else [])])
    one = ArxModel(orders, theta, np.eye(theta.size), 1.0, 1.0, 100)
    n = max(len(a), nk + len(b) - 1)
    numerator = np.concatenate((np.zeros(nk), b, np.zeros(n - nk - len(b) + 1)))
    denominator = np.concatenate(([1.0], a, np.zeros(n - len(a))))
    if not np.any(numerator):
        return
    system = control.tf(numerator, denominator, DT_S)
    expected = control.frequency_response(system, 2.0 * np.pi * GRID).complex.ravel()
    np.testing.assert_allclose(frequency_response(one, GRID, DT_S).response, expected, atol=1e-10)


def test_bands_are_those_of_many_draws() -> None:
    u, y = model16(seed=1, n=1000, noise=0.1)
    one = fit_arx(IoData.from_arrays(u, y), ArxOrders(3, 3, 1, offset=True))
    # Below 0.3 Hz the integrator's pole, near z = 1, leaves nothing to first order.
    grid = np.geomspace(0.5, 9.9, 40)
    found = frequency_response(one, grid, DT_S)
    draws = np.random.default_rng(2).multivariate_normal(one.theta, one.covariance, size=4000)
    sample = np.array(
        [
            frequency_response(
                ArxModel(one.orders, theta, one.covariance, 1.0, 1.0, 1000), grid, DT_S
            ).response
            for theta in draws
        ]
    )
    relative = np.log(sample / found.response)
    magnitude = found.magnitude_band_db(0.95)
    phase = found.phase_band_deg(0.95)
    half_db = 20.0 / np.log(10.0) * 1.959964 * relative.real.std(axis=0)
    half_deg = np.degrees(1.959964 * relative.imag.std(axis=0))
    # 4 sigma of a deviation from 4000 draws, 1.1 % each, and 3 % for the second order.
    np.testing.assert_allclose(0.5 * np.diff(magnitude)[:, 0], half_db, rtol=0.075)
    np.testing.assert_allclose(0.5 * np.diff(phase)[:, 0], half_deg, rtol=0.075)
    np.testing.assert_allclose(magnitude.mean(axis=1), found.magnitude_db)


@pytest.mark.thorough
def test_bands_hold_the_truth_in_95_of_100_records() -> None:
    grid = np.array([0.5, 2.0, 6.0])
    truth = FrequencyResponse(grid, response_of_16(grid), "truth")
    inside, in_band = np.zeros(3), np.zeros(3)
    runs = 300
    for seed in range(runs):
        u, y = model16(seed=seed, n=600, noise=0.1)
        one = fit_arx(IoData.from_arrays(u, y), ArxOrders(3, 3, 1))
        inside += agreement(one, truth, DT_S).inside
        low, high = frequency_response(one, grid, DT_S).magnitude_band_db().T
        in_band += (low <= truth.magnitude_db) & (truth.magnitude_db <= high)
    # Binomial, 300 of 95 %: 285 +- 3.8; 4 sigma.
    for count in (*inside, *in_band):
        assert abs(count - 0.95 * runs) < 15.1


def test_agreement_with_itself_and_with_another() -> None:
    one = ArxModel(ArxOrders(3, 3, 1), np.r_[A16, B16], 1e-8 * np.eye(6), 1.0, 1.0, 1000)
    truth = FrequencyResponse(GRID, response_of_16(GRID), "truth")
    same = agreement(one, truth, DT_S)
    assert same.inside.all()
    np.testing.assert_allclose(same.magnitude_difference_db, 0.0, atol=1e-9)
    turned = FrequencyResponse(GRID, 2.0 * np.exp(0.5j) * truth.response, "another")
    other = agreement(one, turned, DT_S)
    assert not other.inside.any()
    np.testing.assert_allclose(other.magnitude_difference_db, -20.0 * np.log10(2.0), atol=1e-9)
    np.testing.assert_allclose(other.phase_difference_deg, -np.degrees(0.5), atol=1e-9)


def test_the_phase_does_not_jump() -> None:
    phase = FrequencyResponse(GRID, response_of_16(GRID), "truth").phase_deg
    assert np.abs(np.diff(phase)).max() < 180.0


def test_the_band_of_the_input_s_power() -> None:
    n = 2000
    u = multisine(n, DT_S, band_hz=(0.5, 4.0), rms=1.0, rng=np.random.default_rng(1)) + 7.0
    data = IoData.from_arrays(u, u, dt_s=DT_S)
    low, high = power_band(data)
    # 351 lines of equal power, 0.01 Hz apart: half a percent is less than two of them.
    assert low == pytest.approx(0.51, abs=0.011)
    assert high == pytest.approx(3.99, abs=0.011)
    assert power_band(IoData.from_arrays(u, u))[1] == pytest.approx(high * DT_S)


def test_a_part_of_an_agreement() -> None:
    one = ArxModel(ArxOrders(3, 3, 1), np.r_[A16, B16], 1e-8 * np.eye(6), 1.0, 1.0, 1000)
    whole = agreement(one, FrequencyResponse(GRID, 2.0 * response_of_16(GRID), "another"), DT_S)
    part = whole.within((1.0, 2.0))
    assert 0 < part.inside.size < GRID.size
    assert (part.frequency_hz >= 1.0).all()
    assert (part.frequency_hz <= 2.0).all()


@pytest.mark.parametrize("grid", [[0.0, 1.0], [1.0, 10.0], [2.0, 1.0], [1.0, 1.0]])
def test_frequencies_outside_the_range_are_refused(grid: list[float]) -> None:
    one = ArxModel(ArxOrders(3, 3, 1), np.r_[A16, B16], np.eye(6), 1.0, 1.0, 1000)
    with pytest.raises(IdentificationError, match="10 Hz"):
        frequency_response(one, grid, DT_S)
