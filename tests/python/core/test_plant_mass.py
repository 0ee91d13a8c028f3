# SPDX-License-Identifier: MIT
"""A mass over the position: a boom whose angle scipy integrates, energy, and the least mass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import plant_runs as runs
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_reference import typical
from scipy.integrate import solve_ivp

import ehsid

FloatArray = npt.NDArray[np.float64]
DT_S = 1e-3
# A boom of 400 kg m^2: distances, m, from its pivot to the foot of the cylinder and to the eye of
# the rod, length of the cylinder at position 0, m, and moment of its weight where level, N m.
INERTIA, PIVOT, LEVER, RETRACTED, WEIGHT, LEVEL = 400.0, 1.0, 0.6, 0.5, 1200.0, 0.9
MASS, FRICTION = 1200.0, 900.0
GAIN = 1000.0  # N/V


def angle_at(y: FloatArray) -> FloatArray:
    """By the law of cosines, rad."""
    rest = PIVOT**2 + LEVER**2 - (RETRACTED + y) ** 2
    return np.asarray(np.arccos(rest / (2.0 * PIVOT * LEVER)))


def rod_at(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position of the rod, m, and its derivative by the angle."""
    length = np.sqrt(PIVOT**2 + LEVER**2 - 2.0 * PIVOT * LEVER * np.cos(angle))
    return length - RETRACTED, PIVOT * LEVER * np.sin(angle) / length


def on_axis(
    command: FloatArray,
    tables: Sequence[tuple[str, str, FloatArray]],
    at_knots: FloatArray,
    position: float,
    friction: float = 0.0,
    speed: float = 0.0,
    substeps: int = 2,
) -> FloatArray:
    """Position and speed, shape (N, 2), of an axis of 1200 kg with tables."""
    values = typical() | {
        "axis.mass_kg": MASS,
        "axis.viscous_friction_n_s_m": friction,
        "axis.force_per_volt": GAIN,
        "initial.position_m": position,
        "initial.velocity_m_s": speed,
    }
    row = np.hstack([runs.vector(values), at_knots[np.newaxis]])
    outputs, _ = ehsid.simulate_plant(
        "axis", row, command, dt_s=DT_S, substeps=substeps, tables=tables
    )
    return np.asarray(outputs[0, :, :2])


def test_a_boom_is_a_mass_and_a_force_over_the_position() -> None:
    """Its reduced mass is J (d phi / dy)^2, which grows by more than half here."""
    command = runs.steps(7, 1500, 150, 4.0) + 1.8
    knots = np.linspace(0.0, 0.9, 400)
    angles = angle_at(knots)
    arm = rod_at(angles)[1]
    mass, force = INERTIA / arm**2, WEIGHT * np.cos(angles - LEVEL) / arm
    tables = [("mass", "position_m", knots), ("force", "position_m", knots)]
    start = 0.35
    found = on_axis(command, tables, np.concatenate([mass - MASS, force]), start, FRICTION)

    def rates(_: float, state: FloatArray, volts: float) -> list[float]:
        angle, turn = state
        own = float(rod_at(angle)[1])
        on_rod = GAIN * volts - FRICTION * own * turn
        return [turn, (on_rod * own - WEIGHT * float(np.cos(angle - LEVEL))) / INERTIA]

    state, expected = np.array([float(angle_at(np.array(start))), 0.0]), np.empty((1500, 2))
    for k, volts in enumerate(command):
        y, own = rod_at(state[0])
        expected[k] = y, own * state[1]
        run = solve_ivp(rates, (0.0, DT_S), state, args=(volts,), rtol=1e-9, atol=1e-12)
        state = run.y[:, -1]
    assert 0.25 < np.ptp(expected[:, 0]) < 0.7
    visited = np.interp(expected[:, 0], knots, mass)
    assert visited.max() > 1.5 * visited.min()
    # Steps of 0.5 ms, and knots 2.5 mm apart: both errors are of second order.
    assert np.max(np.abs(found[:, 0] - expected[:, 0])) < 2e-5 * np.ptp(expected[:, 0])
    # Without the term m' v^2 / 2 it would be another motion.
    constant = on_axis(command, tables, np.concatenate([0.0 * mass, force]), start, FRICTION)
    assert np.max(np.abs(constant[:, 0] - expected[:, 0])) > 0.02 * np.ptp(expected[:, 0])


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.floats(-0.7, 2.0), min_size=6, max_size=6),
    st.floats(50.0, 4000.0),
    st.floats(-1.5, 1.5),
)
def test_energy_stays(shares: list[float], stiffness: float, speed: float) -> None:
    """Without friction m(y) v^2 / 2 and the energy of a spring by a table keep their sum."""
    knots = np.linspace(-1.0, 1.0, 6)
    more = MASS * np.array(shares)
    tables = [("mass", "position_m", knots), ("force", "position_m", np.array([-2.0, 2.0]))]
    spring = np.array([-2.0, 2.0]) * stiffness
    run = on_axis(np.zeros(1500), tables, np.concatenate([more, spring]), 0.1, speed=speed)
    position, velocity = run.T
    inside = np.abs(position) < 2.0
    mass = MASS + np.interp(position, knots, more)
    energy = 0.5 * mass * velocity**2 + 0.5 * stiffness * position**2
    # Where a knot lies within a step, the mass is wrong by the bend times the step at most. Steps
    # between knots have errors of second order.
    slopes = np.diff(more, prepend=more[0], append=more[-1]) / np.diff(knots)[0]
    crossed = np.diff(np.searchsorted(knots, position)) != 0
    bends = np.interp(position[:-1], knots, np.abs(np.diff(slopes)))[crossed]
    steps = np.abs(np.diff(position))[crossed]
    errors = float(np.sum(bends * steps / mass[:-1][crossed]))
    assert np.max(np.abs(energy[inside] / energy[0] - 1.0)) < 1e-3 + errors


def test_a_quarter_of_the_mass_stays() -> None:
    command = np.full(300, 1.0)
    knots = np.array([0.0, 1.0])
    tables = [("mass", "position_m", knots)]
    quarter = on_axis(command, tables, np.full(2, -0.75 * MASS), 0.4)
    less = on_axis(command, tables, np.array([-1.5 * MASS, -0.8 * MASS]), 0.4)
    np.testing.assert_allclose(less, quarter, rtol=1e-12)
    # v = F t / m; the motor's force begins half a step early (leapfrog).
    expected = GAIN / (0.25 * MASS) * DT_S * 299
    assert less[-1, 1] == pytest.approx(expected, rel=2e-3)


def test_a_mass_is_given_over_the_position_and_is_no_signal() -> None:
    with pytest.raises(ValueError, match="a mass is given over position_m only"):
        on_axis(np.zeros(5), [("mass", "time_s", np.array([0.0, 1.0]))], np.zeros(2), 0.1)
    values = runs.vector(typical())
    with pytest.raises(ValueError, match="a mass is no signal"):
        ehsid.simulate_plant(
            "axis", values, np.zeros(5), dt_s=DT_S, disturbances=[("mass", np.zeros(5))]
        )
