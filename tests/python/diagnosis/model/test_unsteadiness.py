# SPDX-License-Identifier: MIT
"""What friction that differs from time to time changes, where a rod slides and where it sticks."""

from __future__ import annotations

import gap_cases as made
import numpy as np
import pytest

from ehsid.harness.diagnosis.deciding import REPEATS
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.unsteadiness import unsteady_friction_power
from ehsid.harness.records import make_record
from ehsid.harness.signals.excitation import triangle
from ehsid.harness.signals.simulation import simulate

STRIBECK = "stribeck_friction"


def slow_case(static_n: float, command: float) -> tuple[Case, np.ndarray]:
    """A rod that creeps to and fro, and the x of what it truly has."""
    values = {
        f"effects.{STRIBECK}.coulomb_n": 900.0,
        f"effects.{STRIBECK}.static_n": static_n,
        f"effects.{STRIBECK}.stribeck_velocity_m_s": 0.004,
    }
    signal = triangle(4000, made.DT_S, amplitude=command, period_s=4.0)
    run = simulate(made.RIG, signal, dt_s=made.DT_S, values=values, substeps=4).record
    columns = {name: run.column(name) for name in ("command_v", *made.PRESSURES)}
    record = make_record({"time_s": run.time_s, **columns})
    case = make_case(made.RIG, [record], [record])
    problem = case.problem((STRIBECK,))
    x = problem.centre()
    for place, parameter in enumerate(problem.parameters):
        if parameter.name in values:
            x[place] = parameter.place(values[parameter.name])
    return case, x


def changed_share(case: Case, x: np.ndarray) -> float:
    """What changes of the pressure in A, as a share of its motion, rms over the octaves."""
    problem = case.problem((STRIBECK,))
    changed = unsteady_friction_power(problem, x)["pressure_a_pa"]
    pressures = [record.inside(record.outputs["pressure_a_pa"]) for record in problem.records]
    spectrum = problem.spectrum
    motion = spectrum.powers(spectrum.transform(pressures, differences=False))
    moves = slice(1, None)  # the mean level is no motion
    sizes = spectrum.sizes[moves]
    return float(np.sqrt(changed[moves] @ sizes / (motion[moves] @ sizes)))


def test_much_changes_where_a_rod_sticks_and_slips_and_little_where_it_slides() -> None:
    """A sliding rod: friction is a part of the force, and the friction differs by REPEATS."""
    sticks, slides = (changed_share(*slow_case(2500.0, command)) for command in (0.2, 4.0))
    assert sticks > REPEATS
    assert 0.0 < slides < REPEATS


def test_a_sliding_rod_changes_by_what_its_force_balance_says() -> None:
    """Of a valve with matched edges the flows tell how both pressures share a force.

    Edges: (p_s - p_A) / A_A^2 = (p_B - p_T) / A_B^2, and the same when retracting, so that a force
    changes the pressure in A by its own change / (A_A (1 + (A_B / A_A)^3)). The rod reverses in
    less than a tenth of the time.
    """
    case, x = slow_case(1000.0, 4.0)
    bore, rod = (made.RIG.values[f"cylinder.{name}_m"] for name in ("bore", "rod"))
    area, ratio = np.pi / 4 * bore**2, 1 - (rod / bore) ** 2
    sizes = case.problem((STRIBECK,)).spectrum.sizes
    powers = unsteady_friction_power(case.problem((STRIBECK,)), x)["pressure_a_pa"]
    change = np.sqrt(powers @ sizes / sizes.sum())
    assert change == pytest.approx(REPEATS * 900.0 / (area * (1 + ratio**3)), rel=0.1)


@pytest.mark.parametrize("effects", [(), ("load_force",)])
def test_nothing_changes_without_friction(effects: tuple[str, ...]) -> None:
    case, _ = slow_case(1000.0, 4.0)
    problem = case.problem(effects)
    assert unsteady_friction_power(problem, problem.centre()) == {}
    same = case.with_unsteady_friction(effects, problem.centre())
    assert not any(same.unknown.values())
