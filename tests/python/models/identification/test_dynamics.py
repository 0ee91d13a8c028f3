# SPDX-License-Identifier: MIT
"""Poles, gain and servo of a model are those of the system it was made of."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from identification_truth import arx_output

import ehsid
from ehsid.harness.models.identification import ArxModel, ArxOrders, IoData, fit_arx
from ehsid.harness.models.identification.dynamics import dynamics

DT_S = 1e-3
SERVO = ehsid.ContinuousServo(gain=0.03, omega_n=120.0, xi=0.4)


def model_of(a: list[float], b: list[float], deviation: float = 1e-9) -> ArxModel:
    theta = np.array([*a, *b])
    orders = ArxOrders(len(a), len(b), 1, offset=False)
    return ArxModel(orders, theta, deviation**2 * np.eye(theta.size), 1e-12, 1e-12, 10_000)


def test_a_servo_is_read_from_a_noisy_record_within_its_deviations() -> None:
    theta = ehsid.discretise(SERVO, DT_S)
    rng = np.random.default_rng(1)
    u = rng.normal(size=20_000)
    y = arx_output(theta[:3], theta[3:], 1, u, 1e-7 * rng.normal(size=u.size))
    found = dynamics(fit_arx(IoData.from_arrays(u, y, dt_s=DT_S), ArxOrders(3, 3, 1)), DT_S)
    assert found.servo is not None
    assert found.why_no_servo == ""
    assert found.velocity_gain == found.servo.gain
    assert found.static_gain is None
    for name in ("gain", "omega_n", "xi"):
        figure = getattr(found.servo, name)
        assert figure.deviation is not None
        assert abs(figure.value - getattr(SERVO, name)) < 4.0 * figure.deviation
        assert figure.deviation < 0.05 * figure.value
    pair = next(pole for pole in found.poles if pole.imag > 0.0)
    assert pair.frequency_hz == pytest.approx(SERVO.omega_n / (2.0 * math.pi), rel=0.02)
    assert pair.damping == pytest.approx(SERVO.xi, rel=0.05)


def test_a_model_that_does_not_integrate_has_a_static_gain_with_its_deviation() -> None:
    deviation = 1e-3
    found = dynamics(model_of([-0.5], [1.0], deviation), DT_S)
    assert found.stable
    assert found.velocity_gain is None
    assert found.static_gain is not None
    assert found.static_gain.value == pytest.approx(2.0)
    # d(b / (1 + a)) = (db - 2 da) / 0.5
    assert found.static_gain.deviation == pytest.approx(deviation * math.sqrt(5.0) / 0.5)


def test_the_lag_is_the_slope_of_the_phase_at_rest() -> None:
    deviation = 1e-3
    model = model_of([-0.5], [1.0], deviation)
    found = dynamics(model, DT_S).lag_s
    assert found is not None
    omega = 1e-3
    phase = cmath.phase(1.0 / cmath.exp(1j * omega) / (1.0 - 0.5 / cmath.exp(1j * omega)))
    # The phase is odd in omega: its next term is smaller by omega squared.
    assert found.value == pytest.approx(-DT_S * phase / omega, rel=1e-5)
    # -a / (1 + a) has the derivative -1 / (1 + a)^2; a single b moves no phase.
    assert found.deviation == pytest.approx(DT_S * deviation / 0.25)
    assert dynamics(model, None).lag_s is None


@pytest.mark.parametrize("poles", [[1.1], [0.5, 1.02], [0.5, -1.1], [1.0, 0.9 + 0.6j, 0.9 - 0.6j]])
def test_an_unstable_model_has_no_gain(poles: list[complex]) -> None:
    b = [1.0, *[0.0] * (len(poles) - 1)]
    found = dynamics(model_of(np.poly(poles)[1:].real.tolist(), b), DT_S)
    assert not found.stable
    assert found.static_gain is None
    assert found.velocity_gain is None


def test_other_orders_and_records_without_time_say_why_there_is_no_servo() -> None:
    found = dynamics(model_of([-1.5, 0.7], [1.0, 0.5]), DT_S)
    assert found.servo is None
    assert "na = 2 and nb = 2" in found.why_no_servo
    theta = ehsid.discretise(SERVO, DT_S).tolist()
    unknown = dynamics(model_of(theta[:3], theta[3:], 1e-12), None)
    assert unknown.servo is None
    assert "sampling time" in unknown.why_no_servo
    assert unknown.velocity_gain is None
    assert unknown.static_gain is None  # it integrates all the same
    assert all(pole.frequency_hz is None for pole in unknown.poles)


def test_a_third_order_model_that_is_no_servo_says_why() -> None:
    poles = np.poly([0.9, 0.5, 0.4])[1:].tolist()
    found = dynamics(model_of(poles, [1.0, 0.0, 0.0]), DT_S)
    assert found.servo is None
    assert "no real pole at z = 1" in found.why_no_servo


def test_a_delay_has_no_frequency() -> None:
    found = dynamics(model_of([-0.5, 0.0], [1.0, 0.5]), DT_S)
    assert [pole.frequency_hz is None for pole in found.poles] == [False, True]
