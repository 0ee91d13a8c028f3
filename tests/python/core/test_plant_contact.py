# SPDX-License-Identifier: MIT
"""A rod that meets a spring, and one that a falling load pushes on, against closed forms."""

import numpy as np
import plant_runs as runs
import pytest
from plant_reference import typical

MASS, SPEED, AT = 50.0, 0.4, 0.02
FREE = {"axis.mass_kg": MASS, "axis.viscous_friction_n_s_m": 0.0, "initial.position_m": 0.0}


@pytest.mark.parametrize("stiffness", [2e4, 1e6, 3e7])
@pytest.mark.parametrize("substeps", [2, 8])
def test_a_mass_bounces_with_the_speed_that_it_had(stiffness: float, substeps: int) -> None:
    """y = at + v / w sin(w t) for half a turn, w^2 = k / m. What no step follows is softer."""
    values = typical() | FREE | {"initial.velocity_m_s": SPEED}
    values |= {
        "effects.contact_spring.position_m": AT,
        "effects.contact_spring.stiffness_n_m": stiffness,
    }
    found = runs.simulate(values, np.zeros(120), substeps, "axis")
    time_s = runs.DT_S * np.arange(120)
    w = np.sqrt(stiffness / MASS)
    met, left = AT / SPEED, AT / SPEED + np.pi / w
    expected = np.select(
        [time_s < met, time_s < left],
        [SPEED * time_s, AT + SPEED / w * np.sin(w * (time_s - met))],
        AT - SPEED * (time_s - left),
    )
    step = runs.DT_S / substeps
    # It enters and leaves somewhere within a step.
    error = np.abs(found["position_m"] - expected)[time_s < left + 0.01]
    assert error.max() < 2.0 * SPEED * step
    assert found["velocity_m_s"][-1] == pytest.approx(-SPEED, rel=0.25 if w * step > 0.5 else 0.02)


@pytest.mark.parametrize("stiffness", [-2e3, 2e3])
def test_a_spring_of_either_sign_moves_as_its_closed_form(stiffness: float) -> None:
    """y = y0 cosh(sqrt(-k / m) t): of an axis the spring is about zero."""
    values = typical() | FREE | {"initial.position_m": 0.01}
    values["effects.load_spring.stiffness_n_m"] = stiffness
    found = runs.simulate(values, np.zeros(120), 8, "axis")["position_m"]
    turn = np.sqrt(complex(-stiffness / MASS)) * runs.DT_S * np.arange(120)
    np.testing.assert_allclose(found, 0.01 * np.cosh(turn).real, rtol=1e-4, atol=1e-7)
