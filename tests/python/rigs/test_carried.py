# SPDX-License-Identifier: MIT
"""Which effects can act on a user's simulator, told from the rig file alone."""

from __future__ import annotations

from dataclasses import replace

import pytest
from user_simulators import FOLDER, needs_linux64

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.carried import INSIDE, carried

pytestmark = needs_linux64

ALWAYS = {
    *("transport_delay", "valve_hysteresis", "spool_stiction", "valve_lag", "valve_null_bias"),
    *("valve_flow_saturation", "valve_dead_band", "valve_dead_band_sides", "flow_gain_drift"),
    *("sensor_lag", "sensor_quantisation", "sensor_backlash", "sensor_nonlinearity"),
    "position_sensor_delay",
}
FORCES = {
    *("coulomb_friction", "coulomb_friction_sides", "stribeck_friction", "position_friction"),
    *("load_spring", "load_force", "contact_spring"),
}
FLOWS = {"internal_leakage", "external_leakage", "relief_valve", "makeup_check"}
OF_PRESSURES = {f"pressure_sensor_{what}" for what in ("gain", "offset", "lag")}
NEVER = {"entrained_air", "flexible_load", "line_resonance", "counterbalance_valve"}


@pytest.fixture(scope="module")
def rig() -> Rig:
    return read_rig(FOLDER / "rig.toml")


def without(rig: Rig, part: str, *names: str) -> Rig:
    assert rig.simulator is not None
    kept = {name: of for name, of in getattr(rig.simulator, part).items() if name not in names}
    return replace(rig, simulator=replace(rig.simulator, **{part: kept}))


def refused(rig: Rig) -> dict[str, str]:
    return {effect: reason for effect, reason in carried(rig).items() if reason is not None}


def test_every_effect_of_the_catalogue_is_told(rig: Rig) -> None:
    assert list(carried(rig)) == list(effects())
    assert {*ALWAYS, *FORCES, *FLOWS, *NEVER, "supply_droop"} <= set(effects())


def test_a_simulator_with_all_ports_carries_all_but_what_is_inside(rig: Rig) -> None:
    found = refused(rig)
    assert set(found) == set(effects()) - {*ALWAYS, *FORCES, *FLOWS, *OF_PRESSURES, "supply_droop"}
    assert set(found.values()) == {INSIDE}
    assert set(found) >= NEVER


def test_without_ports_the_command_and_the_outputs_are_left() -> None:
    found = carried(read_rig(FOLDER / "rig_portless.toml"))
    assert {effect for effect, reason in found.items() if reason is None} == ALWAYS
    assert {found[effect] for effect in FORCES} == {"the simulator has no input for forces"}
    assert {found[one] for one in FLOWS} == {
        "the simulator has no inputs for flows into the chambers"
    }
    assert found["supply_droop"] == "the simulator has no input for the supply pressure"


def test_what_an_effect_needs_to_know_of_the_simulator(rig: Rig) -> None:
    always = set(refused(rig))
    one_side = refused(without(rig, "ports", "flow_b_m3_s"))
    assert set(one_side) - always == FLOWS
    blind = refused(without(rig, "outputs", "pressure_a_pa"))
    assert set(blind) - always == FLOWS | OF_PRESSURES
    assert blind["relief_valve"] == "the simulator has no output for the chamber pressures"
    flow = refused(without(rig, "outputs", "supply_flow_m3_s"))
    assert {one: flow[one] for one in set(flow) - always} == {
        "supply_droop": "the simulator has no output for the supply flow"
    }


def test_effects_about_the_stroke_and_the_supply_need_those_values(rig: Rig) -> None:
    always = set(refused(rig))
    for name, missed in (
        ("cylinder.stroke_m", {"load_spring", "position_friction"}),
        ("supply.pressure_pa", {"relief_valve", "supply_droop"}),
    ):
        values = {key: value for key, value in rig.values.items() if key != name}
        found = refused(replace(rig, values=values))
        assert set(found) - always == missed
        assert {found[one] for one in missed} == {f"the rig file does not tell {name}"}
