# SPDX-License-Identifier: MIT
"""Models as systems of python-control: against numpy on the unit circle and scipy."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st
from identification_truth import A16, B16, model16

import ehsid
from ehsid.harness.models.identification import ArxOrders, IdentificationError, IoData, fit_arx
from ehsid.harness.models.identification.loop import arx_system, servo_system, to_control

DT_S = 0.05


coefficients = st.integers(-1500, 1500).map(lambda number: number / 1000.0)


@given(
    a=st.lists(coefficients, min_size=1, max_size=5),
    b=st.lists(coefficients, min_size=1, max_size=4),
    nk=st.integers(0, 6),
    offset=st.booleans(),
)
def test_the_system_has_the_response_of_the_difference_equation(
    a: list[float], b: list[float], nk: int, offset: bool
) -> None:
    orders = ArxOrders(len(a), len(b), nk, offset=offset)
    system = arx_system(orders, [*a, *b, *([7.0] if offset else [])], DT_S)
    assert system.dt == DT_S
    # B(z^-1) z^-nk and A(z^-1) at some points off the roots of A, which can lie on the circle.
    z = 3.0 * np.exp(1j * np.linspace(0.1, 3.1, 7))
    numerator = z**-nk * np.polyval(b[::-1], 1.0 / z)
    denominator = np.polyval([*a[::-1], 1.0], 1.0 / z)
    np.testing.assert_allclose(
        system(z) * denominator, numerator, rtol=1e-10, atol=1e-12 * np.abs(denominator).max()
    )


def test_an_estimated_model_answers_as_its_parameters_say() -> None:
    u, y = model16(seed=3, n=2000, noise=0.0, nk=2)
    model = fit_arx(IoData.from_arrays(u, y, dt_s=DT_S), ArxOrders(3, 3, 2, offset=True))
    system = to_control(model, DT_S)
    circle = np.exp(2j * np.pi * np.array([0.1, 1.0, 4.0]) * DT_S)
    truth = circle**-2 * np.polyval(B16[::-1], 1 / circle) / np.polyval([*A16[::-1], 1], 1 / circle)
    np.testing.assert_allclose(system(circle), truth, rtol=1e-8)
    poles = np.sort_complex(system.poles())
    # Four poles: three of A, one of the delay.
    np.testing.assert_allclose(poles, np.sort_complex([0.0, *np.roots([1.0, *A16])]), atol=1e-8)


def test_without_a_sampling_time_the_system_counts_samples() -> None:
    system = arx_system(ArxOrders(1, 1), [-0.5, 1.0], None)
    assert system.dt is True
    response = control.step_response(system, 4)
    np.testing.assert_allclose(response.outputs, [0.0, 1.0, 1.5, 1.75, 1.875])


@pytest.mark.parametrize(
    ("theta", "dt_s", "words"),
    [
        ([-0.5], 0.1, r"theta has shape \(1,\), expected \(2,\)"),
        ([-0.5, 1.0, 0.0], 0.1, r"theta has shape \(3,\)"),
        ([-0.5, 1.0], 0.0, "dt_s = 0: expected a finite number above 0"),
        ([-0.5, 1.0], float("nan"), "dt_s = nan"),
    ],
)
def test_what_is_no_model_is_refused(theta: list[float], dt_s: float, words: str) -> None:
    with pytest.raises(IdentificationError, match=words):
        arx_system(ArxOrders(1, 1), theta, dt_s)


@pytest.mark.parametrize(("omega_n", "xi"), [(13.0, 0.47), (60.0, 0.05), (8.0, 1.6)])
def test_the_servo_sampled_by_control_is_that_of_discretise_and_of_scipy(
    omega_n: float, xi: float
) -> None:
    servo = ehsid.ContinuousServo(gain=0.02, omega_n=omega_n, xi=xi)
    system = servo_system(servo)
    sampled = control.sample_system(system, DT_S, method="zoh")
    numerator, denominator, _ = scipy.signal.cont2discrete(
        ([0.02 * omega_n**2], [1.0, 2.0 * xi * omega_n, omega_n**2, 0.0]), DT_S, method="zoh"
    )
    theta = np.asarray(ehsid.discretise(servo, DT_S))
    for a, b in (
        (sampled.den[0][0][1:], sampled.num[0][0][-3:]),
        (denominator[1:], numerator[0, 1:]),
    ):
        np.testing.assert_allclose(theta, [*a, *b], atol=1e-12)
