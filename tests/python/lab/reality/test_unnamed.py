# SPDX-License-Identifier: MIT
"""Laws without a name: the machine has the curve that the answer says it has."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from reality_runs import DT_S, drawn_case, own_run

from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.case import start_state
from ehsid.lab.reality.effects import CATALOGUE
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.unnamed import OUTSIDE, UNNAMED

FloatArray = npt.NDArray[np.float64]


def machines(name: str) -> tuple[Truth, Truth]:
    """The machine with a law, and without it."""
    case = drawn_case(7, "plain", "open", [name])
    return case.truth, case.healthy


def rates(t: Truth, state: FloatArray, time: float = 2.0) -> FloatArray:
    d = np.empty(equations.STATES)
    equations.slope_of(time, state, 0.1, float(state[equations.Y]), t, d)
    return d


def test_no_law_has_the_name_of_an_effect() -> None:
    assert not set(UNNAMED) & {*CATALOGUE, *OUTSIDE}


@pytest.mark.thorough
def test_a_seed_goes_on_to_draw_the_machines_that_it_drew() -> None:
    drawn = {
        effect
        for seed in range(40)
        for effect in drawn_case(seed, "plain", "open").answer["effects"]
    }
    assert drawn <= set(OUTSIDE)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cubic_spring", "turbulent_drag", "later_load"])
@pytest.mark.parametrize("share", [0.1, 0.45, 0.8])
def test_a_force_opposes_extension_by_the_curve(name: str, share: float) -> None:
    t, healthy = machines(name)
    state = start_state(t, share * t.stroke_m)
    state[equations.V] = share - 0.4
    time = 12.0 * share
    lost = rates(healthy, state, time)[equations.V] - rates(t, state, time)[equations.V]
    of = {"position_m": state[equations.Y], "velocity_m_s": state[equations.V], "time_s": time}
    expected = float(UNNAMED[name].curve(np.array([of[UNNAMED[name].of]]), t)[0])
    assert expected != 0.0
    # Rounding: the forces of the pressures are some 1e5 N.
    assert lost * t.mass_kg == pytest.approx(expected, rel=1e-9, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("x", [-0.9, -0.3, -0.05, 0.0, 0.1, 0.5, 1.0])
def test_a_valve_of_two_gains_opens_by_the_curve(x: float) -> None:
    t, healthy = machines("dual_gain_valve")
    without_bias = t._replace(null_bias=0.0)
    more = float(UNNAMED["dual_gain_valve"].curve(np.array([x]), t)[0])
    plain = equations.opening(x, healthy._replace(null_bias=0.0))
    assert equations.opening(x, without_bias) - plain == pytest.approx(more, abs=1e-12)
    # At full opening it passes what the data sheet says.
    assert equations.opening(1.0, without_bias) == pytest.approx(1.0, abs=1e-12)


def test_a_null_that_drifts_is_a_bias_of_the_curve_at_that_time() -> None:
    t, healthy = machines("drifting_null")
    state = start_state(t, 0.4 * t.stroke_m)
    state[equations.X] = 0.2
    bias = float(UNNAMED["drifting_null"].curve(np.array([5.0]), t)[0])
    biased = healthy._replace(null_bias=healthy.null_bias + bias)
    np.testing.assert_allclose(rates(t, state, 5.0), rates(biased, state, 5.0), rtol=1e-9)


def test_oil_leaks_from_the_cap_side_by_the_curve() -> None:
    t, healthy = machines("orifice_leak")
    state = start_state(t, 0.4 * t.stroke_m)
    p_a, _ = equations.chamber_pressures(2.0, state, t)
    volume = t.dead_volume_a_m3 + t.area_a_m2 * state[equations.Y]
    more = (rates(t, state) - rates(healthy, state))[equations.C_A] * volume
    expected = float(UNNAMED["orifice_leak"].curve(np.array([p_a]), t)[0])
    assert expected < 0.0
    assert more == pytest.approx(expected, rel=1e-9)


def test_a_bent_scale_reads_too_much_beyond_its_place() -> None:
    t, healthy = machines("bent_scale")
    # The first reading, of a rod at rest; fewer errors than the step of the reading of 1e-12 m.
    for share in (0.2, 0.9):
        position = share * t.stroke_m
        read, true = (
            own_run(each, start_state(each, position), np.zeros(2))[0, equations.OUT_Y]
            for each in (t, healthy)
        )
        expected = float(UNNAMED["bent_scale"].curve(np.array([position]), t)[0])
        assert read - true == pytest.approx(expected, abs=2e-12)
        assert (expected == 0.0) == (share < 0.4)


def test_a_delay_grows_by_the_curve() -> None:
    t, healthy = machines("growing_delay")
    t = t._replace(delay_rate=0.01)
    pulse = np.zeros(400)
    pulse[300:] = 0.5
    start = start_state(t, 0.5 * t.stroke_m)
    arrives = [
        int(np.argmax(np.abs(own_run(each, start, pulse)[:, equations.OUT_X]) > 1e-6))
        for each in (t, healthy)
    ]
    later = float(UNNAMED["growing_delay"].curve(np.array([0.3]), t)[0])
    assert later == pytest.approx(0.003)
    # Both are seen at the first sample after they arrive.
    assert abs((arrives[0] - arrives[1]) * DT_S - later) <= DT_S * (1.0 + 1e-9)
    assert math.isclose(t.delay_s, healthy.delay_s)
