# SPDX-License-Identifier: MIT
from dataclasses import replace

import numpy as np
import pytest
from sources import ROOT

import ehsid
from ehsid.harness.diagnosis.data.regimes import Regimes, visited
from ehsid.harness.diagnosis.search.identifiability import (
    extrapolated_effects,
    unidentifiable_effects,
    unmeasured_effects,
)
from ehsid.harness.diagnosis.search.search import candidate_effects
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import odd_multisine, random_steps, triangle
from ehsid.harness.signals.simulation import simulate

RIG = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
IDS = [effect.id for effect in ehsid.effects()]
DT_S = 1e-3
RICH = Regimes(
    largest_command=0.8,
    near_null=0.1,
    resting=0.3,
    slow=0.1,
    command_reversals=20,
    motion_reversals=20,
    travel=0.5,
    at_ends=0.0,
    load_signs=2,
    fast_power_hz=50.0,
    lowest_pressure_pa=2e6,
    highest_pressure_pa=9e6,
    highest_of_supply=0.75,
    lowest_of_tank=0.8,
    positions_m=(0.05, 0.2),
    position_floor_m=1e-5,
    seconds=20.0,
)


def test_a_rich_record_identifies_every_effect() -> None:
    assert unidentifiable_effects([RICH], IDS) == []


@pytest.mark.parametrize(
    ("change", "effects", "words"),
    [
        (
            {"largest_command": 0.26},
            ["valve_flow_saturation", "supply_droop", "line_resonance"],
            "never above 26 % of rated",
        ),
        (
            {"near_null": 0.001},
            ["valve_dead_band", "valve_dead_band_sides"],
            "near null for 0.1 %",
        ),
        ({"resting": 0.01}, ["spool_stiction"], "rests for 1.0 %"),
        ({"command_reversals": 1}, ["valve_hysteresis"], "turns 1 times only"),
        (
            {"motion_reversals": 0},
            [
                "coulomb_friction",
                "coulomb_friction_sides",
                "stribeck_friction",
                "position_friction",
                "sensor_backlash",
                "valve_dead_band_sides",
            ],
            "the rod turns 0 times",
        ),
        ({"slow": 0.0}, ["stribeck_friction"], "slow motion for 0.0 %"),
        (
            {"fast_power_hz": 1.0},
            [
                *("transport_delay", "valve_lag", "line_resonance", "flexible_load", "sensor_lag"),
                *("position_sensor_delay", "pressure_sensor_lag"),
            ],
            "no power above 1.0 Hz",
        ),
        (
            {"travel": 0.02},
            ["load_spring", "contact_spring", "position_friction", "sensor_nonlinearity"],
            "covers 2 % of the stroke",
        ),
        ({"seconds": 2.0}, ["flow_gain_drift"], "lasts 2.0 s only"),
        ({"lowest_pressure_pa": 6e6}, ["entrained_air"], "within 6e+06 to 9e+06 Pa"),
        ({"highest_of_supply": 0.55}, ["relief_valve"], "above 55 % of the supply pressure"),
        ({"lowest_of_tank": 4.0}, ["makeup_check"], "the lowest one was 4.0 times as high"),
    ],
)
def test_a_regime_that_was_not_visited_is_reported(
    change: dict[str, float], effects: list[str], words: str
) -> None:
    poor = replace(RICH, **change)
    unidentifiable = unidentifiable_effects([poor], IDS)
    assert sorted(effect.id for effect in unidentifiable) == sorted(effects)
    assert all(words in effect.why for effect in unidentifiable)
    # Another record that visits the regime is enough.
    assert unidentifiable_effects([poor, RICH], IDS) == []


def test_reasons_add_up() -> None:
    poor = replace(RICH, motion_reversals=1, slow=0.0)
    (friction,) = [
        effect for effect in unidentifiable_effects([poor], IDS) if effect.id == "stribeck_friction"
    ]
    assert "turns 1 times" in friction.why
    assert "slow motion" in friction.why


def test_only_requested_effects_are_checked() -> None:
    poor = replace(RICH, largest_command=0.1)
    assert [effect.id for effect in unidentifiable_effects([poor], ["supply_droop"])] == [
        "supply_droop"
    ]
    assert unidentifiable_effects([poor], ["coulomb_friction"]) == []


def test_a_motor_has_neither_valve_nor_oil() -> None:
    reasons = {effect.id: effect.why for effect in unidentifiable_effects([RICH], IDS, "axis")}
    assert reasons["valve_dead_band"] == 'a plant "axis" has no valve'
    assert reasons["entrained_air"] == 'a plant "axis" has no hydraulics'
    subsystems = {effect.id: effect.subsystem for effect in ehsid.effects()}
    without = {effect for effect, part in subsystems.items() if part in ("valve", "hydraulics")}
    of_pressures = {effect for effect in subsystems if effect.startswith("pressure_sensor_")}
    assert {reasons[effect] for effect in of_pressures} == {
        'a plant "axis" has no chamber pressures'
    }
    assert reasons.keys() == without | of_pressures


def test_sensors_of_what_is_not_measured_are_not_tried() -> None:
    own = "position_sensor_delay"
    of_pressures = [each for each in IDS if each.startswith(("pressure_sensor_", "counterb"))]
    assert len(of_pressures) == 4
    both = ("position_m", "pressure_a_pa", "pressure_b_pa")
    assert unmeasured_effects(both, IDS) == []
    for outputs, missing in ((both[:2], of_pressures), (both[:1], [own, *of_pressures])):
        found = unmeasured_effects(outputs, IDS)
        assert {each.id for each in found} == set(missing)
        tried = candidate_effects(RIG, outputs=outputs)
        assert set(candidate_effects(RIG)) - set(tried) == set(missing)
    reasons = {each.id: each.why for each in found}
    assert "looks the same as a late command" in reasons[own]


@pytest.mark.parametrize(
    ("name", "inside", "outside"),
    [
        ("valve_flow_saturation.limit", 0.6, 0.9),
        ("valve_dead_band.overlap", 0.05, 0.85),
        ("valve_hysteresis.half_width", 0.05, 0.85),
        ("spool_stiction.threshold", 0.05, 0.85),
        ("sensor_backlash.half_width_m", 1e-4, 2e-6),
        ("sensor_nonlinearity.amplitude_m", -1e-4, -2e-6),
        ("relief_valve.pressure_pa", 8e6, 9.5e6),
        ("contact_spring.position_m", 0.1, 0.21),
        ("contact_spring.position_m", 0.1, 0.04),
    ],
)
def test_a_size_that_no_record_reached_is_extrapolated(
    name: str, inside: float, outside: float
) -> None:
    effect = name.split(".")[0]
    poor = replace(RICH, largest_command=0.01, position_floor_m=1.0)
    for records in ([RICH], [poor, RICH]):
        assert extrapolated_effects({f"effects.{name}": inside}, records, [effect]) == []
        (extrapolated,) = extrapolated_effects({f"effects.{name}": outside}, records, [effect])
        assert extrapolated.id == effect
    assert extrapolated_effects({}, [RICH], ["coulomb_friction"]) == []


def test_both_widths_of_a_dead_band_must_be_left() -> None:
    widths = {"overlap_a": 0.05, "overlap_b": 0.85}
    values = {f"effects.valve_dead_band_sides.{name}": width for name, width in widths.items()}
    (extrapolated,) = extrapolated_effects(values, [RICH], ["valve_dead_band_sides"])
    assert "85 % wide" in extrapolated.why


def test_signals_show_what_the_page_on_excitation_says() -> None:
    def missing(command: np.ndarray) -> set[str]:
        record = simulate(RIG, command, dt_s=DT_S).record
        return {effect.id for effect in unidentifiable_effects([visited(record, RIG)], IDS)}

    slow = missing(triangle(10000, DT_S, amplitude=0.8, period_s=2.5))  # four periods
    assert {"valve_flow_saturation", "supply_droop"} <= slow
    assert not {"coulomb_friction", "valve_dead_band"} & slow
    rng = np.random.default_rng(2)
    small = missing(odd_multisine(8000, DT_S, band_hz=(0.5, 60.0), peak=1.5, rng=rng).samples)
    assert "valve_flow_saturation" in small
    assert not {"valve_lag", "transport_delay", "valve_dead_band"} & small
    large = missing(random_steps(8000, amplitude=6.0, hold=(100, 400), rng=rng))
    assert not {"valve_flow_saturation", "supply_droop", "coulomb_friction"} & large


def test_the_reason_holds_for_all_records_together() -> None:
    poor = replace(RICH, largest_command=0.08, travel=0.01, lowest_of_tank=9.0)
    poorer = replace(RICH, largest_command=0.2, travel=None, lowest_of_tank=5.0)
    why = {one.id: one.why for one in unidentifiable_effects([poor, poorer], IDS)}
    assert why["supply_droop"] == "command never above 20 % of rated"
    assert why["makeup_check"].endswith("the lowest one was 5.0 times as high")
