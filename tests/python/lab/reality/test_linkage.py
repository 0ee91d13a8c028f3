# SPDX-License-Identifier: MIT
"""A boom that a cylinder turns: geometry, statics and energy, and what a case of it tells."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ehsid.lab.blind.making import GRADES as OF_CHECKS
from ehsid.lab.reality import machine as equations
from ehsid.lab.reality import make_case
from ehsid.lab.reality.batch import draw_kind, draw_seconds
from ehsid.lab.reality.case import start_state
from ehsid.lab.reality.linkage import (
    GRAVITY,
    LARGEST_WEIGHT,
    LAWS,
    LOAD,
    draw_linkage,
    draw_linkage_rig,
    put_linkage,
    weight_at,
)
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.variants import GRADES

FloatArray = np.ndarray[Any, np.dtype[np.float64]]
SEEDS = range(8)


def boom(seed: int) -> Truth:
    rng = np.random.default_rng(seed)
    rig = draw_linkage_rig(rng)
    told = Truth(rig.values["load.mass_kg"], 0.0, rig.stroke_m)
    return put_linkage(told, draw_linkage(rng, rig), 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rod_follows_the_triangle(seed: int) -> None:
    """By plane coordinates: the eye of the rod on a circle, the foot of the cylinder beside it."""
    t = boom(seed)
    places = np.linspace(0.0, t.stroke_m, 7)
    angles = np.array([equations.boom_angle(y, t) for y in places])
    eyes = t.lever_m * np.exp(1j * angles)
    np.testing.assert_allclose(np.abs(eyes - t.pivot_m), t.retracted_m + places, rtol=1e-12)
    # The lever is the distance of the pivot from the line of the cylinder.
    along = (eyes - t.pivot_m) / np.abs(eyes - t.pivot_m)
    levers = [equations.arm(angle, t) for angle in angles]
    np.testing.assert_allclose(levers, np.abs((np.conj(along) * -t.pivot_m).imag), rtol=1e-12)
    assert np.all(np.diff(angles) > 0.0)
    assert math.radians(19.0) < angles[0] < angles[-1] < math.radians(146.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_weight_is_the_slope_of_the_height(seed: int) -> None:
    """F dy = m g dh, with the centre of mass at the height c sin(angle above level)."""
    t = boom(seed)
    angles = np.linspace(equations.boom_angle(0.0, t), equations.boom_angle(t.stroke_m, t), 2001)
    rod = np.array([equations.rod_length(angle, t) for angle in angles])
    height = t.boom_n_m * np.sin(angles - t.boom_level_rad)
    middle = 1000
    slope = (height[middle + 1] - height[middle - 1]) / (rod[middle + 1] - rod[middle - 1])
    assert weight_at(rod[middle] - t.retracted_m, t) == pytest.approx(slope, rel=1e-5)


def test_a_pendulum_on_the_boom_keeps_its_energy_and_has_its_period() -> None:
    """Without any drive the boom hangs and swings: 2 pi sqrt(J / (m g c)) for a small angle."""
    t = boom(3)._replace(force_per_unit_n=1.0, boom_level_rad=0.0)
    hanging = -0.5 * math.pi  # its centre of mass is below the pivot
    t = t._replace(boom_level_rad=equations.boom_angle(0.5 * t.stroke_m, t) - hanging)
    natural = math.sqrt(t.boom_n_m / t.boom_kg_m2)
    start = np.zeros(equations.STATES)
    start[equations.Y] = 0.5 * t.stroke_m
    start[equations.ANGLE] = equations.boom_angle(0.5 * t.stroke_m, t) + 0.02

    def slope(time: float, s: FloatArray) -> FloatArray:
        d = np.empty(equations.STATES)
        equations.slope_of(time, s, 0.0, 0.0, t, d)
        return d

    period = 2.0 * math.pi / natural
    run = solve_ivp(slope, (0.0, period), start, rtol=1e-9, atol=1e-12, dense_output=True)
    angle, turn = run.y[equations.ANGLE], run.y[equations.TURN]
    energy = 0.5 * t.boom_kg_m2 * turn**2 + t.boom_n_m * np.sin(angle - t.boom_level_rad)
    assert np.ptp(energy) < 1e-7 * 0.5 * t.boom_n_m * 0.02**2
    # A swing of 0.02 rad is slower by 0.02^2 / 16.
    assert run.sol(period)[equations.ANGLE] == pytest.approx(start[equations.ANGLE], abs=1e-6)
    # Position and speed of the rod follow the angle.
    length = np.array([equations.rod_length(each, t) for each in angle])
    np.testing.assert_allclose(
        run.y[equations.Y] - run.y[equations.Y][0], length - length[0], atol=1e-8
    )
    speed = np.array([equations.arm(each, t) for each in angle]) * turn
    np.testing.assert_allclose(run.y[equations.V], speed, atol=1e-7)


@pytest.mark.parametrize("seed", SEEDS)
def test_booms_are_those_that_cranes_have(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = draw_linkage_rig(rng)
    assert 0.3 <= rig.stroke_m <= 1.0
    sizes = draw_linkage(rng, rig)
    t = put_linkage(Truth(rig.values["load.mass_kg"], 0.0, rig.stroke_m), sizes, 0.0)
    angle = equations.boom_angle(0.5 * t.stroke_m, t)
    # Its reduced mass at mid-stroke is that of the rig file.
    assert t.boom_kg_m2 / equations.arm(angle, t) ** 2 == pytest.approx(
        rig.values["load.mass_kg"], rel=1e-12
    )
    assert t.boom_n_m == pytest.approx(t.boom_kg_m2 * sizes["centre_1_m"] * GRAVITY, rel=1e-12)
    weights = [weight_at(share * t.stroke_m, t) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert max(map(abs, weights)) < LARGEST_WEIGHT * rig.force_n


def test_a_start_is_at_rest() -> None:
    t = make_case(2, "linkage", "none", seconds=0.1).truth
    start = start_state(t, 0.3 * t.stroke_m)
    d = np.empty(equations.STATES)
    equations.slope_of(0.0, start, 0.0, float(start[equations.Y]), t, d)
    pressed = t.area_a_m2 * t.source_pa
    assert abs(d[equations.TURN] * t.boom_kg_m2) < 1e-6 * pressed * t.lever_m


@pytest.mark.slow
def test_a_case_tells_its_linkage_and_what_is_beside_it() -> None:
    alone = make_case(4, "linkage", "open", seconds=8.0, dt_s=2e-3)
    assert (alone.answer["kind"], list(alone.answer["effects"])) == ("open", ["linkage"])
    assert alone.answer["laws"] == LAWS
    assert alone.answer["subsystem"] == ["mechanics"]
    travel = np.ptp(alone.train["position_m"]) / alone.truth.stroke_m
    assert travel > 0.3
    again = make_case(4, "linkage", "open", seconds=8.0, dt_s=2e-3)
    np.testing.assert_array_equal(again.train["position_m"], alone.train["position_m"])
    lag = make_case(4, "linkage", "one", ["valve_lag"], seconds=1.0, dt_s=2e-3)
    assert list(lag.answer["effects"]) == ["valve_lag", "linkage"]
    assert lag.answer["effects"]["linkage"] == alone.answer["effects"]["linkage"]
    assert lag.answer["kind"] == "open"
    drawn = [make_case(seed, "linkage", "one", seconds=0.1, dt_s=4e-3).answer for seed in range(20)]
    assert not any(
        load in each["effects"] for each in drawn for load in ("load_force", "load_spring")
    )
    assert 2 <= sum(LOAD in each["told"] for each in drawn) <= 18
    with pytest.raises(ValueError, match="hydraulic servos only"):
        make_case(4, "linkage", plant="axis")


def test_two_of_five_linkages_have_an_effect_beside_them() -> None:
    kinds = [draw_kind(seed, "linkage") for seed in range(1000)]
    # Four standard errors of a share of 0.4 of 1000 draws are 0.062.
    assert kinds.count("one") / 1000 == pytest.approx(0.4, abs=0.062)
    assert set(kinds) == {"one", "open"}
    lengths = [draw_seconds(seed, "linkage") for seed in range(300)]
    assert 15.0 <= min(lengths) <= max(lengths) <= 30.0
    assert GRADES == OF_CHECKS
