# SPDX-License-Identifier: MIT
"""The proportional loop: margins and poles against numpy, by the closed loop's own roots."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import scipy.optimize
from identification_truth import A16, B16

from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.models.identification.loop import LoopAnalysis, analyse_loop, arx_system

DT_S = 0.05
# Integrator and a resonance at 0.35 rad a sample with a damping ratio of 0.1, as of an oil spring.
PAIR = np.exp(0.35 * np.array([-0.1 + 1j * np.sqrt(0.99), -0.1 - 1j * np.sqrt(0.99)]))
SPRING = np.polymul([1.0, -1.0], np.poly(PAIR).real)
PLANTS = {
    "model (16)": (A16, B16, 1),
    "model (16) with more delay": (A16, B16, 5),
    "oil spring": (SPRING[1:], np.array([1.0, 4.0, 1.0]) * 1e-3, 1),
    "oil spring, valve turned round": (SPRING[1:], np.array([1.0, 4.0, 1.0]) * -1e-3, 1),
    "first order": (np.array([-0.9]), np.array([0.1]), 1),
    "integrator a hair outside": (np.array([-1.8001, 0.80008]), np.array([0.02]), 3),
}


def analysed(name: str, dt_s: float | None = DT_S) -> LoopAnalysis:
    a, b, nk = PLANTS[name]
    return analyse_loop(arx_system(ArxOrders(a.size, b.size, nk), [*a, *b], dt_s))


def closed_poles(name: str, gain: float) -> npt.NDArray[np.complex128]:
    """Roots of z^m (A + k z^-nk B)."""
    a, b, nk = PLANTS[name]
    size = max(a.size, nk + b.size - 1) + 1
    polynomial = np.zeros(size)
    polynomial[: a.size + 1] = [1.0, *a]
    polynomial[nk : nk + b.size] += gain * b
    return np.roots(polynomial)


def response(name: str, hz: float) -> complex:
    a, b, nk = PLANTS[name]
    back = np.exp(-2j * np.pi * hz * DT_S)
    return complex(back**nk * np.polyval(b[::-1], back) / np.polyval([*a[::-1], 1.0], back))


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTS)
def test_the_limit_is_where_the_poles_of_the_closed_loop_leave_the_circle(name: str) -> None:
    loop = analysed(name)
    assert loop.limit_gain is not None
    assert loop.phase_crossover_hz is not None
    assert np.abs(closed_poles(name, 0.999 * loop.limit_gain)).max() < 1.0
    beyond = closed_poles(name, 1.001 * loop.limit_gain)
    assert np.abs(beyond).max() > 1.0
    # It oscillates at the angle of the pole that leaves.
    at_limit = closed_poles(name, loop.limit_gain)
    leaving = at_limit[np.argmax(np.abs(at_limit))]
    hz = abs(np.angle(leaving)) / (2.0 * np.pi * DT_S)
    assert loop.phase_crossover_hz == pytest.approx(hz, rel=1e-4)
    assert loop.half is not None
    assert loop.half.gain == pytest.approx(0.5 * loop.limit_gain)
    assert loop.half.gain_margin == pytest.approx(2.0)
    assert loop.unity.gain_margin == pytest.approx(abs(loop.limit_gain))


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTS)
def test_phase_margin_poles_and_stability_are_those_of_numpy(name: str) -> None:
    loop = analysed(name)
    for one in loop.loops:
        poles = closed_poles(name, one.gain)
        assert one.stable == bool(np.abs(poles).max() < 1.0)
        upper = poles[(poles.imag >= 0.0) & (np.abs(poles) > 1e-9)]
        assert len(one.modes) == upper.size
        for mode in one.modes:
            nearest = upper[np.argmin(np.abs(upper - mode.pole))]
            assert mode.pole == pytest.approx(nearest, abs=1e-6)
            s = np.log(complex(nearest)) / DT_S
            assert mode.frequency_hz == pytest.approx(abs(s) / (2.0 * np.pi), rel=1e-4)
            assert mode.damping == pytest.approx(-s.real / abs(s), abs=1e-4)
        if one.gain_crossover_hz is None:
            grid = np.geomspace(1e-5, 0.499999 / DT_S, 500)
            sizes = np.array([abs(one.gain * response(name, hz)) for hz in grid])
            assert (sizes < 1.0).all() or (sizes > 1.0).all()
            continue
        at = one.gain_crossover_hz
        exact = scipy.optimize.brentq(
            lambda hz, k=one.gain: abs(k * response(name, hz)) - 1.0, 0.99 * at, 1.01 * at
        )
        assert at == pytest.approx(exact, rel=1e-5)
        phase = np.angle(one.gain * response(name, exact), deg=True) % 360.0
        assert one.phase_margin_deg == pytest.approx(phase - 180.0, abs=0.01)


@pytest.mark.slow
def test_the_gain_has_the_sign_that_counteracts_an_error() -> None:
    as_is, turned = analysed("oil spring"), analysed("oil spring, valve turned round")
    assert as_is.limit_gain is not None
    assert as_is.limit_gain > 0.0
    assert turned.limit_gain == pytest.approx(-as_is.limit_gain)
    assert turned.unity.gain == -1.0


def test_a_plant_whose_phase_stays_small_has_no_limit() -> None:
    loop = analyse_loop(arx_system(ArxOrders(1, 1, 0), [-0.5, 0.1], DT_S))
    assert loop.limit_gain is None
    assert loop.half is None
    assert loop.loops == (loop.unity,)
    assert loop.unity.stable
    assert np.isinf(loop.unity.gain_margin)


def test_a_model_without_response_has_no_limit() -> None:
    loop = analyse_loop(arx_system(ArxOrders(1, 1), [-0.5, 0.0], DT_S))
    assert loop.limit_gain is None
    assert loop.unity.gain_crossover_hz is None
    assert loop.unity.stable


def test_half_the_limit_of_a_plant_that_runs_away_is_told_to_be_unstable() -> None:
    # A pole at 1.5 and too long a delay: no proportional gain holds it.
    loop = analyse_loop(arx_system(ArxOrders(1, 1, 6), [-1.5, 0.1], DT_S))
    assert loop.half is not None
    assert not loop.half.stable


@pytest.mark.slow
def test_without_a_sampling_time_frequencies_are_in_cycles_a_sample() -> None:
    timed, counted = analysed("oil spring"), analysed("oil spring", None)
    assert timed.phase_crossover_hz is not None
    assert counted.phase_crossover_hz == pytest.approx(timed.phase_crossover_hz * DT_S, rel=1e-9)
    assert [mode.frequency_hz for mode in counted.modes] == pytest.approx(
        [mode.frequency_hz * DT_S for mode in timed.modes]
    )
    assert counted.modes[-1].damping == pytest.approx(0.1, abs=1e-6)
