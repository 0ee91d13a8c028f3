# SPDX-License-Identifier: MIT
"""What is lost of a rod that sticks and slips, beside one that slides."""

from __future__ import annotations

import gap_cases as made
import numpy as np
import pytest

from ehsid.harness.diagnosis.deciding import REPEATS
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.unsteadiness import lost_motion_power
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


def lost_share(case: Case, x: np.ndarray) -> float:
    """What is lost of the pressure in A, as a share of its motion, rms over the octaves."""
    problem = case.problem((STRIBECK,))
    lost = lost_motion_power(problem, x)["pressure_a_pa"]
    pressures = [record.inside(record.outputs["pressure_a_pa"]) for record in problem.records]
    spectrum = problem.spectrum
    motion = spectrum.powers(spectrum.transform(pressures, differences=False))
    moves = slice(1, None)  # the mean level is no motion
    sizes = spectrum.sizes[moves]
    return float(np.sqrt(lost[moves] @ sizes / (motion[moves] @ sizes)))


def test_much_is_lost_where_a_rod_sticks_and_slips_and_little_where_it_slides() -> None:
    """The friction differs by REPEATS; of its square nothing is lost where the rod slides."""
    sticks, slides = (lost_share(*slow_case(2500.0, command)) for command in (0.2, 4.0))
    assert sticks > REPEATS
    assert slides < REPEATS**2


@pytest.mark.parametrize("effects", [(), ("load_force",)])
def test_nothing_is_lost_without_friction(effects: tuple[str, ...]) -> None:
    case, _ = slow_case(1000.0, 4.0)
    problem = case.problem(effects)
    assert lost_motion_power(problem, problem.centre()) == {}
    same = case.with_lost_motion(effects, problem.centre())
    assert not any(same.unknown.values())
