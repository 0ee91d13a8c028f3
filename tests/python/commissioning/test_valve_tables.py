# SPDX-License-Identifier: MIT
"""The tables of a valve are those of the simulator, and the inverse takes them back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid
from ehsid.harness.commissioning.known import Known
from ehsid.harness.commissioning.valve import Sizes, valve_of
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.rigs.new import published_rig

OVERLAP = "effects.valve_dead_band_sides.overlap_"
BIAS, LIMIT = "effects.valve_null_bias.offset", "effects.valve_flow_saturation.limit"
shares = st.floats(0.0, 0.1)


def known(values: dict[str, float], found: dict[str, Estimate] | None = None) -> Known:
    return Known("bench", "rig.toml", published_rig().with_values(values), found or {})


@pytest.mark.slow
@given(a=shares, b=shares, bias=st.floats(-0.1, 0.1), limit=st.floats(0.3, 2.0))
def test_the_inverse_takes_the_characteristic_back(
    a: float, b: float, bias: float, limit: float
) -> None:
    valve = valve_of(known({OVERLAP + "a": a, OVERLAP + "b": b, BIAS: bias, LIMIT: limit}))
    for one in (valve.extending, valve.retracting):
        assert np.all(np.diff(one.side * one.inverse_command) > 0.0)
        back = Sizes(a, b, bias, limit).opening(one.inverse_command)
        np.testing.assert_allclose(back, one.inverse_opening, atol=1e-12)
        # As a controller reads both, linear between the points.
        at = np.abs(one.inverse_opening)
        command = np.interp(np.abs(one.opening), at, one.inverse_command)
        np.testing.assert_allclose(command, one.command, atol=2e-3)
        nearer = one.side * (one.inverse_command - one.inverse_low)
        assert np.all(nearer >= -1e-12)
        assert one.side * (one.edge.value - one.safe_command[0]) >= 0.0


def test_the_characteristic_is_that_of_the_simulator() -> None:
    """The speed of a rod that moves steadily is zero in the dead band alone."""
    rig = published_rig().with_values({OVERLAP + "a": 0.05, OVERLAP + "b": 0.02, BIAS: 0.01})
    valve = valve_of(Known("bench", "rig.toml", rig))
    volts = 10.0 * np.array([valve.extending.edge.value, valve.retracting.edge.value])
    for volt, outward in zip(volts, (1.0, -1.0), strict=True):
        speeds = []
        for beyond in (-0.1, 0.1):
            plant = ehsid.Plant("ehs", rig.plant_values(), dt_s=1e-3, substeps=8)
            speeds.append(plant.run(np.full(600, volt + outward * beyond))[-1, 1])
        assert abs(speeds[0]) < 0.2 * abs(speeds[1])
        assert math.copysign(1.0, speeds[1]) == outward


def test_bands_hold_the_characteristic_of_every_end() -> None:
    found = {OVERLAP + "a": Estimate(0.04, 0.03, 0.06), BIAS: Estimate(0.01, 0.005, 0.02)}
    valve = valve_of(known({OVERLAP + "a": 0.04, BIAS: 0.01}, found))
    side = valve.extending
    assert side.edge.value == pytest.approx(0.03)
    # Half intervals add as squares; a larger bias opens earlier.
    assert side.edge.low == pytest.approx(0.03 - math.hypot(0.01, 0.01))
    assert side.edge.high == pytest.approx(0.03 + math.hypot(0.02, 0.005))
    for a, bias in ((0.03, 0.01), (0.06, 0.01), (0.04, 0.02)):
        opening = Sizes(a, 0.0, bias).opening(side.command)
        assert np.all(opening >= side.opening_low - 1e-12)
        assert np.all(opening <= side.opening_high + 1e-12)


def test_a_valve_that_never_opens_is_refused() -> None:
    with pytest.raises(ValueError, match=r"that extend the rod open at .* expected less than 1"):
        valve_of(known({OVERLAP + "a": 0.3, LIMIT: 0.3}))
