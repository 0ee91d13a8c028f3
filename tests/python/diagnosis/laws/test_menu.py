# SPDX-License-Identifier: MIT
"""The laws that are tried, and where their knots lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import DT_S, OFF, RIG, record

from ehsid.harness.diagnosis.laws.forms import KNOTS, KNOTS_OF_TIME, MENU, laws, visited
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.search.candidates import nominal_candidate
from ehsid.harness.records import make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.rig import TableLaw
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import simulate

SERVO = make_case(RIG, [record(OFF, 1)], [record(OFF, 2)])


def test_a_servo_has_the_whole_menu() -> None:
    found = laws(SERVO, nominal_candidate(SERVO))
    expected = {(equation, of) for equation, variables in MENU.items() for of in variables}
    assert {(law.adds_to, law.of) for law in found} == expected
    assert len({law.name for law in found}) == len(found)


def test_knots_rise_over_what_was_visited() -> None:
    candidate = nominal_candidate(SERVO)
    here = visited(SERVO, candidate)
    for law in laws(SERVO, candidate):
        assert law.knots.size == (KNOTS_OF_TIME if law.of == "time_s" else KNOTS)
        assert np.all(np.diff(law.knots) > 0.0)
        assert here[law.of].min() <= law.knots[0] < law.knots[-1] <= here[law.of].max()


def test_laws_over_a_pressure_begin_at_that_of_the_tank() -> None:
    # Below it free gas decides. A heavy load pulls the oil of a chamber apart.
    heavy = replace(RIG, values={**RIG.values, "load.mass_kg": 800.0})
    command = 10.0 * np.sign(np.sin(2.0 * np.pi * np.arange(2000) * DT_S))
    run = simulate(heavy, command, dt_s=DT_S).record
    names = ("command_v", "position_m", "pressure_a_pa", "pressure_b_pa")
    hard = make_record({"time_s": run.time_s, **{name: run.column(name) for name in names}})
    case = make_case(heavy, [hard])
    candidate = nominal_candidate(case)
    tank = RIG.values["supply.tank_pressure_pa"]
    here = visited(case, candidate)
    assert min(here["pressure_a_pa"].min(), here["pressure_b_pa"].min()) < 0.9 * tank
    over_pressure = [law for law in laws(case, candidate) if "pressure" in law.of]
    assert len(over_pressure) == 2
    assert all(law.knots[0] >= tank for law in over_pressure)


@pytest.mark.parametrize("of", ["velocity_m_s", "spool"])
def test_knots_are_closer_near_zero_where_laws_bend(of: str) -> None:
    law = next(each for each in laws(SERVO, nominal_candidate(SERVO)) if each.of == of)
    distances = np.diff(law.knots)
    assert distances.argmin() in range(KNOTS // 2 - 3, KNOTS // 2 + 2)
    assert distances.max() > 5.0 * distances.min()


def test_a_law_adds_to_those_that_an_earlier_diagnosis_found() -> None:
    # The values of fitted tables come last: a name twice would put them into other tables.
    table = TableLaw("force", "position_m", (0.0, 0.3), (100.0, 300.0))
    own = {"force_of_position_m": table, "force_of_position_m_2": table, "other": table}
    rig = replace(RIG, tables=own)
    case = make_case(rig, [record(OFF, 1)], [record(OFF, 2)])
    candidate = nominal_candidate(case)
    found = {law.name: law for law in laws(case, candidate)}
    assert not set(found) & set(own)
    law = found["force_of_position_m_3"]
    problem = case.problem(laws=(law,))
    assert problem.rig.tables == {**own, law.name: law.table(np.zeros(KNOTS))}
    x = np.concatenate([candidate.x, np.zeros(KNOTS)])
    assert problem.cost(x) == pytest.approx(case.problem().cost(candidate.x), rel=1e-12)


def test_an_axis_has_force_mass_sensor_and_delay_only() -> None:
    values = {
        "axis.mass_kg": 95.0,
        "axis.viscous_friction_n_s_m": 200.0,
        "axis.force_per_volt": 35.0,
    }
    rig = Rig("axis", "axis", values, sensors={"position_noise_m": 1e-6})
    rng = np.random.default_rng(3)
    command = multisine(1500, DT_S, band_hz=(0.5, 10.0), rms=2.0, rng=rng)
    run = simulate(rig, command, dt_s=DT_S).record
    columns = {name: run.column(name) for name in ("command_v", "position_m")}
    case = make_case(rig, [make_record({"time_s": run.time_s, **columns})])
    found = laws(case, nominal_candidate(case))
    assert {law.adds_to for law in found} == {"force", "mass", "sensor", "delay"}
