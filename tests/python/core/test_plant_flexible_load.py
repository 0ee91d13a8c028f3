# SPDX-License-Identifier: MIT
"""A mass that hangs on the rod: its motion by formula, its order, few steps, alignment."""

import numpy as np
import plant_runs as runs
import pytest
from plant_reference import typical

import ehsid

SHARE, FREQUENCY_HZ = 0.4, 12.0


def flexible(damping: float, **more: float) -> dict[str, float]:
    return typical() | {
        "axis.mass_kg": 50.0,
        "axis.viscous_friction_n_s_m": 0.0,
        "effects.flexible_load.mass_share": SHARE,
        "effects.flexible_load.frequency_hz": FREQUENCY_HZ,
        "effects.flexible_load.damping": damping,
        **more,
    }


def test_two_masses_under_a_steady_force_move_as_the_formula_says() -> None:
    """v = F / m (t + mu sin(W t) / W), mu = m_2 / m_1, W = w sqrt(1 + mu) without damping."""
    values = flexible(0.0, **{"initial.position_m": 0.0})
    found = runs.simulate(values, np.full(200, 2.0), 64, "axis")
    time_s = np.arange(200) * runs.DT_S
    mu = SHARE / (1.0 - SHARE)
    turn = 2.0 * np.pi * FREQUENCY_HZ * np.sqrt(1.0 + mu)
    push = 2.0 * values["axis.force_per_volt"] / values["axis.mass_kg"]
    expected = push * (time_s + mu * np.sin(turn * time_s) / turn)
    # The frequency is right within (W h)^2 / 24 = 4e-7, over four turns.
    np.testing.assert_allclose(
        found["velocity_m_s"][1:], expected[1:], atol=1e-5 * np.ptp(expected)
    )


@pytest.mark.slow
@pytest.mark.parametrize("plant", ["axis", "ehs"])
def test_it_is_of_second_order_from_a_moving_start(plant: str) -> None:
    values = flexible(0.1, **{"initial.velocity_m_s": 0.1, "axis.viscous_friction_n_s_m": 900.0})
    command = runs.steps(1, 60, 10, 5.0)
    expected = runs.reference(values, command, plant)
    coarse, medium, fine = (
        runs.worst_error(
            runs.simulate(values, command, substeps, plant),
            expected,
            ("position_m", "velocity_m_s"),
        )
        for substeps in (8, 16, 32)
    )
    assert coarse / medium > 3.5
    assert medium / fine > 3.5


@pytest.mark.parametrize("plant", ["axis", "ehs"])
def test_one_too_fast_for_the_steps_stays_bounded(plant: str) -> None:
    """2 pi 300 Hz sqrt(1 + 9) would turn by 12 rad a step; it swings as fast as the steps allow."""
    fast = {"effects.flexible_load.mass_share": 0.9, "effects.flexible_load.frequency_hz": 300.0}
    values = flexible(1e-3, **fast)
    command = runs.steps(2, 2000, 10, 3.0)
    varied = [
        runs.NAMES.index(f"effects.flexible_load.{name}") for name in ("mass_share", "damping")
    ]
    outputs, slopes = ehsid.simulate_plant(
        plant, runs.vector(values), command, dt_s=runs.DT_S, substeps=2, varied=varied
    )
    rigid = runs.simulate(
        values
        | {
            f"effects.flexible_load.{name}": 0.0
            for name in ("mass_share", "frequency_hz", "damping")
        },
        command,
        2,
        plant,
    )
    speed = outputs[0, :, 1]
    assert np.abs(speed).max() < 5.0 * np.abs(rigid["velocity_m_s"]).max()
    assert np.isfinite(slopes[..., :2]).all()


def test_steps_are_recommended_for_the_faster_of_two_oscillations() -> None:
    def steps(plant: str, **values: float) -> int:
        return ehsid.plant_substeps(plant, runs.vector(flexible(0.1, **values))[0], 0.1)

    # On an axis without seals only the masses swing, against each other.
    turn = 2.0 * np.pi * FREQUENCY_HZ / np.sqrt(1.0 - SHARE)
    assert steps("axis") == np.ceil(3.0 * turn * 0.1)
    # On oil, the slower load takes its mass from the rod: m_1 alone swings.
    slow = steps("ehs", **{"effects.flexible_load.frequency_hz": 0.5})
    whole = steps("ehs", **{"effects.flexible_load.mass_share": 0.0})
    assert slow / whole == pytest.approx(1.0 / np.sqrt(1.0 - SHARE), rel=0.02)


def test_the_load_moves_along_where_the_rod_is_put_elsewhere() -> None:
    values = flexible(0.05)
    command = runs.steps(3, 100, 10, 3.0)
    aligned = np.full((100, 4), np.nan)
    aligned[40, 0] = 0.4
    free = runs.simulate(values, command, 8, "axis")
    outputs, _ = ehsid.simulate_plant(
        "axis", runs.vector(values), command, dt_s=runs.DT_S, substeps=8, aligned=aligned
    )
    assert outputs[0, 40, 0] == pytest.approx(0.4, abs=1e-15)
    # No force of an axis depends on the position, but that of the spring would.
    np.testing.assert_allclose(outputs[0, :, 1], free["velocity_m_s"], rtol=1e-12, atol=1e-14)


def test_the_load_goes_on_with_the_rod_where_that_is_given_another_velocity() -> None:
    values = flexible(0.05)
    command = runs.steps(3, 100, 10, 3.0)
    free = runs.simulate(values, command, 8, "axis")
    aligned = np.full((100, 4), np.nan)
    aligned[40, 1] = free["velocity_m_s"][40] + 0.1
    outputs, _ = ehsid.simulate_plant(
        "axis", runs.vector(values), command, dt_s=runs.DT_S, substeps=8, aligned=aligned
    )
    # Without viscous friction all moves as before, seen from a frame that moves.
    faster = np.where(np.arange(100) < 40, 0.0, 0.1)
    np.testing.assert_allclose(outputs[0, :, 1], free["velocity_m_s"] + faster, atol=1e-12)
