# SPDX-License-Identifier: MIT
"""Tables of a rig file: read, written, refused with a reason, and simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from windowed_runs import simulate_windows

from ehsid.harness.rigs import RigError, parse_rig
from ehsid.harness.rigs.rig import EQUATIONS, VARIABLES, TableLaw
from ehsid.harness.rigs.rig_file import rig_text
from ehsid.harness.signals.simulation import simulate

EHS = """
name = "bench"
plant = "ehs"
[cylinder]
bore_m = 0.063
rod_m = 0.035
stroke_m = 0.300
dead_volume_a_m3 = 2.5e-4
dead_volume_b_m3 = 2.5e-4
[load]
mass_kg = 120.0
viscous_friction_n_s_m = 900.0
[valve]
rated_flow_m3_s = 6.33e-4
rated_pressure_drop_pa = 3.5e6
rated_command_v = 10.0
[supply]
pressure_pa = 12.0e6
tank_pressure_pa = 2.0e5
[fluid]
bulk_modulus_pa = 1.1e9
"""
AXIS = """
plant = "axis"
[axis]
mass_kg = 80.0
viscous_friction_n_s_m = 300.0
force_per_volt = 20.0
"""
TABLE = """
[effects.table.wear]
adds_to = "force"
of = "position_m"
knots = [0.0, 0.15, 0.3]
values = [0.0, 400.0, 100.0]
"""
LAW = TableLaw("force", "position_m", (0.0, 0.15, 0.3), (0.0, 400.0, 100.0))
finite = st.floats(-1e9, 1e9)


@st.composite
def laws(draw: st.DrawFn) -> TableLaw:
    count = draw(st.integers(2, 12))
    first = draw(st.floats(-100.0, 100.0))
    widths = draw(st.lists(st.floats(1e-3, 10.0), min_size=count - 1, max_size=count - 1))
    knots = tuple(float(knot) for knot in np.cumsum([first, *widths]))
    values = tuple(draw(st.lists(finite, min_size=count, max_size=count)))
    equation = draw(st.sampled_from(EQUATIONS))
    over = ("position_m",) if equation == "mass" else VARIABLES
    return TableLaw(equation, draw(st.sampled_from(over)), knots, values)


@pytest.mark.slow
@given(tables=st.dictionaries(st.from_regex(r"[A-Za-z0-9_-]+", fullmatch=True), laws(), max_size=3))
def test_a_written_table_is_read_as_it_was(tables: dict[str, TableLaw]) -> None:
    rig = replace(parse_rig(EHS), tables=tables)
    assert parse_rig(rig_text(rig)).tables == rig.tables


def test_a_table_of_a_rig_file_acts_in_the_simulation() -> None:
    rig, plain = parse_rig(EHS + TABLE), parse_rig(EHS)
    assert dict(rig.tables) == {"wear": LAW}
    assert rig.effects() == ()  # it has no id of the catalogue
    command = 3.0 * np.sin(2.0 * np.pi * 1.5 * np.arange(1500) * 1e-3)
    run, without = (simulate(each, command, dt_s=1e-3) for each in (rig, plain))
    # Pressures carry the force: p_a A_a - p_b A_b = m a + b v + F, of which only F differs at rest.
    changed = run.record.column("pressure_a_pa") - without.record.column("pressure_a_pa")
    assert np.max(np.abs(changed)) > 1e4
    # Halving the step changes little: the table does not spoil the integration.
    assert max(run.error.values()) < 1e-3
    # Windows that start from the record of the same rig reproduce it.
    again = simulate_windows(rig, run.record, substeps=run.substeps)
    position = run.record.column("position_m")
    used = again.window >= 0
    error = (again.outputs["position_m"][0] - position)[used]
    assert np.max(np.abs(error)) < 1e-3 * np.ptp(position)


def test_an_axis_takes_tables_that_it_can_have() -> None:
    rig = parse_rig(AXIS + TABLE)
    assert dict(rig.tables) == {"wear": LAW}
    for wrong in ('"flow_a"', '"spool"'):
        with pytest.raises(RigError, match="expected one of force, sensor, delay, mass"):
            parse_rig(AXIS + TABLE.replace('"force"', wrong))
    with pytest.raises(RigError, match="expected one of velocity_m_s, position_m, time_s"):
        parse_rig(AXIS + TABLE.replace('"position_m"', '"pressure_a_pa"'))


@pytest.mark.parametrize(
    ("changed", "into", "message"),
    [
        ('"force"', '"farce"', r"'effects.table.wear.adds_to' = 'farce': expected one of spool"),
        (
            '"force"\nof = "position_m"',
            '"mass"\nof = "velocity_m_s"',
            r"table.wear.of' = 'velocity_m_s': a mass is given over position_m",
        ),
        ('"position_m"', "3", r"'effects.table.wear.of' = 3: expected one of velocity_m_s"),
        ("knots = [0.0, 0.15, 0.3]", "", r"'effects.table.wear' has no knots"),
        ("0.15, 0.3]", "0.15, 0.1]", r"knots\[2\]' = 0.1 after 0.15: expected knots that rise"),
        ("0.15, 0.3]", "0.0, 0.3]", r"knots\[1\]' = 0 after 0: expected knots that rise"),
        ("[0.0, 400.0, 100.0]", "[0.0, 400.0]", "has 2 numbers for 3 knots"),
        ("[0.0, 400.0, 100.0]", "[0.0, nan, 1.0]", r"values\[1\]' = nan: expected a finite number"),
        ("[0.0, 400.0, 100.0]", '"high"', "expected a list of numbers"),
        ("[0.0, 0.15, 0.3]\nvalues = [0.0, 400.0, 100.0]", "[1.0]\nvalues = [1.0]", "2 to 100"),
        ("[0.0, 0.15, 0.3]", "[0.0, 1e-320, 0.3]", "its slope is not finite"),
        ("values", "colour = 3\nvalues", r"effects.table.wear: 'colour' is not known"),
        ("[effects.table.wear]", '[effects.table."two words"]', "a name of letters, digits"),
    ],
)
def test_a_wrong_table_says_what_is_wrong_and_where(changed: str, into: str, message: str) -> None:
    assert changed in TABLE
    with pytest.raises(RigError, match=message):
        parse_rig(EHS + TABLE.replace(changed, into))


def test_a_wrong_plant_is_named_beside_its_tables() -> None:
    with pytest.raises(RigError, match=r"'plant' = \['ehs'\]: expected"):
        parse_rig(EHS.replace('"ehs"', '["ehs"]') + TABLE)


def test_sections_that_are_no_tables_are_refused() -> None:
    with pytest.raises(RigError, match=r"expected a section \[effects.table.NAME\]"):
        parse_rig(EHS + "[effects]\ntable = 3\n")
    with pytest.raises(RigError, match=r"expected \[effects.table.wear\] with adds_to"):
        parse_rig(EHS + "[effects.table]\nwear = 3\n")
