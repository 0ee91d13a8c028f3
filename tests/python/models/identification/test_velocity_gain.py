# SPDX-License-Identifier: MIT
"""The velocity gain of a model is that of the servo it was made of, and of an integrator only."""

from __future__ import annotations

import numpy as np
import pytest
from identification_truth import arx_output

import ehsid
from ehsid.harness.models.identification import ArxModel, ArxOrders, IoData, fit_arx
from ehsid.harness.models.identification.dynamics import (
    dynamics,
    integrator,
    poles_zeros,
    velocity_gain,
)

DT_S = 1e-3
SERVO = ehsid.ContinuousServo(gain=0.03, omega_n=120.0, xi=0.4)


def exact(theta: np.ndarray, n_rows: int = 5000) -> ArxModel:
    return ArxModel(ArxOrders(3, 3, 1), theta, 1e-24 * np.eye(6), 1e-12, 1e-12, n_rows)


@pytest.mark.parametrize("gain", [0.03, -0.2])
def test_the_gain_of_a_servo_is_found_again(gain: float) -> None:
    servo = ehsid.ContinuousServo(gain=gain, omega_n=SERVO.omega_n, xi=SERVO.xi)
    found = velocity_gain(exact(ehsid.discretise(servo, DT_S)), DT_S)
    assert found == pytest.approx(gain, rel=1e-6)


def test_it_is_found_from_a_noisy_record() -> None:
    theta = ehsid.discretise(SERVO, DT_S)
    rng = np.random.default_rng(1)
    u = rng.normal(size=20_000)
    y = arx_output(theta[:3], theta[3:], 1, u, 1e-7 * rng.normal(size=u.size))
    model = fit_arx(IoData.from_arrays(u, y, dt_s=DT_S), ArxOrders(3, 3, 1))
    assert velocity_gain(model, DT_S) == pytest.approx(SERVO.gain, rel=0.05)


def test_a_model_that_does_not_integrate_has_none() -> None:
    for poles in ([0.9, 0.5, 0.4], [0.9 + 0.1j, 0.9 - 0.1j, -0.2]):
        theta = np.concatenate((np.poly(poles)[1:].real, [1.0, 0.0, 0.0]))
        assert velocity_gain(exact(theta), DT_S) is None


def test_a_slow_pole_integrates_over_a_short_record_only() -> None:
    slow = np.poly([0.999, 0.5, 0.4])[1:]
    theta = np.concatenate((slow, [1.0, 0.0, 0.0]))
    short, long = exact(theta, 500), exact(theta, 5000)
    assert velocity_gain(short, DT_S) == pytest.approx(1.0 / (DT_S * 0.5 * 0.6))
    assert velocity_gain(long, DT_S) is None
    at_one = integrator(short)
    assert at_one is not None
    assert poles_zeros(short).poles.values[at_one] == pytest.approx(0.999)
    assert integrator(long) is None
    for model, integrates in ((short, True), (long, False)):
        (slow,) = [pole for pole in dynamics(model, DT_S).poles if pole.real > 0.9]
        assert slow.integrates == integrates
        assert (slow.frequency_hz is None) == (slow.damping is None) == integrates
