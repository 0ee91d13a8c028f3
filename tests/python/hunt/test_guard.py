# SPDX-License-Identifier: MIT
"""The guard of the limits: against machines that go wherever they are sent."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.diagnosis.limits import Limits
from ehsid.harness.hunt.guard import NEARLY, STOPPING_S, Guard

LIMITS = Limits((0.05, 0.25), 8.0, speed_m_s=0.4, pressure_pa=1.8e7)
DT_S = 1e-3


@given(
    begin=st.floats(0.1, 0.2),
    speed=st.floats(-2.0, 2.0),
    stops_in_s=st.floats(0.0, STOPPING_S),
)
def test_a_rod_that_stops_in_time_never_leaves_its_travel(
    begin: float, speed: float, stops_in_s: float
) -> None:
    limits = Limits(LIMITS.position_m, 8.0)
    guard, position, reason = Guard(limits, DT_S), begin, ""
    for _ in range(2000):
        reason = guard.reason({"position_m": position})
        if reason:
            break
        position += speed * DT_S
    # It comes to rest at a steady deceleration: half of the way at full speed.
    position += 0.5 * speed * stops_in_s
    assert 0.05 <= position <= 0.25
    if abs(speed) > 0.2:
        assert "end of its travel" in reason


@given(command=st.floats(allow_nan=True, allow_infinity=True))
def test_a_command_is_inside_its_limit(command: float) -> None:
    sent = Guard(LIMITS, DT_S).command(command)
    assert abs(sent) <= 8.0
    if math.isfinite(command) and abs(command) <= 8.0:
        assert sent == command
    if not math.isfinite(command):
        assert sent == 0.0


@pytest.mark.parametrize(
    ("sample", "says"),
    [
        ({"position_m": math.nan}, "the position is not a number"),
        ({"position_m": 0.04}, "at 40 mm the rod comes near the lower end of its travel"),
        ({"position_m": 0.25}, "at 250 mm the rod comes near the upper end of its travel"),
        ({"position_m": 0.1, "pressure_a_pa": 1.7e7}, "pressure_a_pa of 170 bar comes near"),
        ({"position_m": 0.1, "pressure_b_pa": math.nan}, "pressure_b_pa of nan bar comes near"),
        ({"position_m": 0.1, "pressure_a_pa": 1.5e7}, ""),
    ],
)
def test_what_ends_an_experiment_is_said(sample: dict[str, float], says: str) -> None:
    reason = Guard(LIMITS, DT_S).reason(sample)
    assert reason.startswith(says) if says else reason == ""


def test_the_speed_is_seen_through_the_noise_of_the_sensor() -> None:
    rng = np.random.default_rng(3)
    slow = Guard(Limits(LIMITS.position_m, 8.0, speed_m_s=0.02), DT_S)
    slow.noise_m = 1e-5
    # 10 um over 2 ms are 7 mm/s: with what is allowed for noise, five of its deviations off.
    assert all(
        slow.reason({"position_m": 0.15 + float(e)}) == "" for e in rng.normal(0.0, 1e-5, 2000)
    )
    assert slow.seen.speed_m_s < 5 * 0.0071
    fast = Guard(LIMITS, DT_S)
    reasons = [fast.reason({"position_m": 0.1 + 0.37 * DT_S * k}) for k in range(50)]
    assert NEARLY * 0.4 < 0.37
    assert "speed of 370 mm/s comes near its limit" in reasons[5]


def test_a_swing_of_the_oil_spring_is_no_noise() -> None:
    """At 100 Hz the speed over 2 ms is 94 % of its peak."""
    guard = Guard(LIMITS, DT_S)
    peak, rad_s = 0.4, 2.0 * np.pi * 100.0
    swing = 0.15 + peak / rad_s * np.sin(rad_s * DT_S * np.arange(40))
    assert any("comes near its limit" in guard.reason({"position_m": float(y)}) for y in swing)


def test_how_far_the_machine_went_is_kept() -> None:
    guard = Guard(LIMITS, DT_S)
    for position, pressure in ((0.1, 1e7), (0.101, 1.2e7), (0.0995, 0.9e7)):
        guard.reason({"position_m": position, "pressure_a_pa": pressure})
        guard.command(-3.0)
    assert guard.seen.position_m == (0.0995, 0.101)
    assert (guard.seen.command_v, guard.seen.pressure_pa) == (3.0, 1.2e7)
    assert Guard(LIMITS, DT_S).seen.pressure_pa is None
