# SPDX-License-Identifier: MIT
"""Margins and gains of the loop, beside python-control and the poles."""

import re

import control
import numpy as np
import pytest

from ehsid.harness.commissioning.loop import Gains, Servo, gains_of, margins, response
from ehsid.harness.diagnosis.schema import Estimate

CYCLE_S = 1e-3
NARROW = Servo(
    Estimate(0.02, 0.019, 0.021), Estimate(150.0, 140.0, 165.0), Estimate(0.1, 0.08, 0.12), 1e-3
)


def designed(servo: Servo, speed: float = 0.5, *, placed: bool = False) -> Gains:
    gains = gains_of(servo, CYCLE_S, speed, placed=placed)
    assert not isinstance(gains, str), gains
    return gains


@pytest.mark.slow
@pytest.mark.parametrize("placed", [False, True])
@pytest.mark.parametrize("valve", [None, Estimate(400.0, 350.0, 450.0)])
def test_margins_are_those_of_python_control_in_every_case(
    valve: Estimate | None, placed: bool
) -> None:
    servo = Servo(NARROW.gain, NARROW.omega_n, NARROW.xi, 1e-3, valve)
    gains = designed(servo, placed=placed)
    omega = np.geomspace(0.5, 3e3, 2500)
    s = 1j * omega
    back = gains.position + gains.velocity * s + gains.acceleration * s**2
    plants = response(servo, 1.5 * CYCLE_S, omega)[1]
    for (k, wn, xi, spool), plant in list(zip(servo.cases(), plants, strict=True))[::7]:
        system = k * wn**2 / (s * (s**2 + 2.0 * xi * wn * s + wn**2)) * np.exp(-s * 2.5e-3)
        system /= 1.0 + 2.0 * servo.valve_damping * s / spool + (s / spool) ** 2
        np.testing.assert_allclose(plant, system, rtol=1e-9)
        gain, phase, *_ = control.stability_margins(control.frd(back * system, omega))
        ours = margins((back * system)[np.newaxis])
        assert ours.gain == pytest.approx(gain, rel=1e-3)
        assert ours.phase_deg == pytest.approx(phase, abs=0.1)
    worst = margins(back * plants)
    assert gains.worst.gain == pytest.approx(worst.gain, rel=0.01)
    assert gains.worst.phase_deg == pytest.approx(worst.phase_deg, abs=0.2)


@pytest.mark.slow
def test_the_fastest_loop_has_the_margins_that_are_promised_and_no_more() -> None:
    for placed in (False, True):
        fast, calm = (designed(NARROW, speed, placed=placed) for speed in (1.0, 0.0))
        assert fast.pole == pytest.approx(4.0 * calm.pole)
        assert fast.worst.enough
        assert min(fast.worst.gain / 2.0, fast.worst.phase_deg / 45.0) < 1.1
        assert calm.worst.gain >= fast.worst.gain


def test_poles_are_where_they_are_placed() -> None:
    """Without delay and spool, and the polynomial of the loop by hand."""
    servo = Servo(
        Estimate(0.02, 0.02, 0.02), Estimate(100.0, 100.0, 100.0), Estimate(0.1, 0.1, 0.1)
    )
    gains = gains_of(servo, 1e-9, 0.2, placed=True)
    assert not isinstance(gains, str)
    numerator = 0.02 * 100.0**2 * np.array([gains.acceleration, gains.velocity, gains.position])
    denominator = np.array([1.0, 20.0 + numerator[0], 1e4 + numerator[1], numerator[2]])
    poles = np.roots(denominator)
    assert gains.damping is not None
    wanted = np.roots(np.polymul([1.0, gains.pole], [1.0, 200.0 * gains.damping, 1e4]))
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(wanted), rtol=1e-4)


def test_an_unstable_loop_has_no_margin() -> None:
    _, plant = response(NARROW, 1.5 * CYCLE_S)
    assert margins(2.0 * 2.0 * 0.1 * 150.0 / 0.02 * plant).gain == 0.0


@pytest.mark.parametrize(
    ("servo", "message"),
    [
        (
            Servo(NARROW.gain, Estimate(150.0, 20.0, 400.0), Estimate(0.2, 0.001, 0.9)),
            r"too wide: .* The widest is xi, 0.001 to 0.9",
        ),
        (Servo(NARROW.gain, NARROW.omega_n, NARROW.xi, 4.0), r"margin not reachable"),
    ],
)
def test_what_the_model_cannot_carry_is_refused_with_the_reason(servo: Servo, message: str) -> None:
    refused = gains_of(servo, CYCLE_S, 0.5, placed=False)
    assert isinstance(refused, str)
    assert re.search(message, refused)
