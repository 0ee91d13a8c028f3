# SPDX-License-Identifier: MIT
import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid
from ehsid.harness.catalogue.parameters import belongs_to, effects, plain_name, value_name
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.show.gap_words import effect_set, interval, number, quantity, unit_of

LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def plain(text: str) -> str:
    return text.replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (120.0, "kg", "120 kg"),
        (2.5e-4, "m^3", "0.25 l"),
        (6.33e-4, "m^3/s", "37.98 l/min"),
        (12e6, "Pa", "120 bar"),
        (1.1e9, "Pa", "1100 MPa"),
        (0.0031, "s", "3.1 ms"),
        (0.85, "1", "0.85"),
        (3.21e-17, "m^3", "3.210·10⁻¹⁴ l"),
        (0.0, "N", "0 N"),
    ],
)
def test_values_are_shown_in_units_of_the_trade(value: float, unit: str, shown: str) -> None:
    assert plain(quantity(value, unit)) == shown


@pytest.mark.parametrize(
    ("name", "value", "shown"),
    [
        # 1 l/min are 1e-3 / 60 m^3/s, 1 bar is 1e5 Pa.
        ("effects.internal_leakage.coefficient_m3_s_pa", 1e-3 / 60.0 / 1e7, "1 l/min at 100 bar"),
        ("effects.external_leakage.coefficient_b_m3_s_pa", 2e-10 / 60.0, "2 l/min at 100 bar"),
        ("linear.leakage_m3_s_pa", 1e-10 / 60.0, "1 l/min at 100 bar"),
        ("linear.flow_pressure_m3_s_pa", 1e-8 / 60.0, "1 l/min per bar"),
        ("effects.relief_valve.flow_gain_m3_s_pa", 3e-8 / 60.0, "3 l/min per bar"),
        ("effects.supply_droop.source_resistance_pa_s_m3", 5e5 * 6e3, "5 bar at 10 l/min"),
        ("effects.supply_droop.accumulator_capacitance_m3_pa", 2e-8, "2 l/bar"),
        ("effects.flow_gain_drift.rate_1_s", 0.003, "0.3 % in a second"),
        ("nuisance.spool_slew_1_s", 40.0, "40 1/s"),
        ("effects.valve_dead_band.overlap", 0.03, "3 % of rated command"),
    ],
)
def test_sizes_are_shown_as_people_ask_for_them(name: str, value: float, shown: str) -> None:
    assert plain(quantity(value, unit_of(name))) == shown


@pytest.mark.parametrize(
    ("estimate", "unit", "value", "ends"),
    [
        (Estimate(412.0, 396.0, 431.0), "N", "412 N", "396 to 431"),
        (Estimate(0.96e9, 0.91e9, 1.01e9), "Pa", "960 MPa", "910 to 1010"),
        (Estimate(0.0123, 0.012, 0.0126), "m", "12.30 mm", "12.00 to 12.60"),
        (Estimate(1e-12, math.nan, math.nan), "m^3/(s Pa)", "0.006000 l/min per bar", "– to –"),
    ],
)
def test_intervals_have_the_digits_they_need(
    estimate: Estimate, unit: str, value: str, ends: str
) -> None:
    found = interval(estimate, unit)
    assert (plain(found[0]), found[1]) == (value, ends)


@given(
    st.floats(-12, 12).map(lambda power: 10.0**power),
    st.floats(1e-6, 0.9),
    st.sampled_from(["N", "m", "Pa", "1"]),
)
def test_ends_of_an_interval_are_never_shown_as_one(size: float, width: float, unit: str) -> None:
    # Seven digits at most: a width of 1e-6 of the size is the least that they can show.
    _, ends = interval(Estimate(size, size * (1.0 - width), size * (1.0 + width)), unit)
    low, high = ends.split(" to ")
    assert low != high


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_every_number_is_shown_as_a_number_or_a_dash(value: float) -> None:
    text = number(value)
    assert re.fullmatch(r"-?\d+(\.\d+)?(·10⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]+)?|–", text)
    if abs(value) < 1e300:  # rounded up, the largest of all would be infinite
        read = float(text.replace("·10", "e").translate(LOWERED))
        # Four digits: half a unit of the fourth.
        assert read == pytest.approx(value, rel=6e-4)


def test_names_are_words() -> None:
    assert effect_set(("coulomb_friction", "load_force")) == "Coulomb friction + load force"
    assert effect_set(()) == "no effect"
    assert value_name("fluid.bulk_modulus_pa") == "bulk modulus of the oil"
    assert value_name("cylinder.dead_volume_a_m3") == "dead volume of the cap side (A)"
    assert value_name("load.viscous_friction_n_s_m") == "viscous friction of the load"
    assert value_name("effects.valve_lag.bandwidth_hz") == "valve lag: bandwidth"
    assert value_name("effects.supply_droop.source_resistance_pa_s_m3").endswith(
        "source resistance"
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", [p.name for p in ehsid.plant_parameters()])
def test_no_name_of_the_plant_shows_a_unit_or_an_underscore(name: str) -> None:
    words = value_name(name)
    assert "_" not in words
    assert not re.search(r" (pa|m3|s|kg|hz|n|m)$", words)


def test_every_value_has_a_name_of_its_own() -> None:
    for section in ("ehs", "axis", "linear"):
        words = [
            value_name(p.name)
            for p in ehsid.plant_parameters()
            if belongs_to(p.name, section) or p.name.startswith("nuisance.")
        ]
        assert len(set(words)) == len(words)


def test_a_share_says_of_what_it_is_a_share() -> None:
    assert {p.unit for p in ehsid.plant_parameters() if p.share_of} == {"1"}
    overlap = "effects.valve_dead_band.overlap"
    assert plain(quantity(0.0355, unit_of(overlap))) == "3.55 % of rated command"
    shown = interval(Estimate(0.0355, 0.0332, 0.0369), unit_of(overlap))
    assert (plain(shown[0]), shown[1]) == ("3.55 % of rated command", "3.32 to 3.69")
    assert unit_of("effects.valve_lag.damping") == "1"


def test_every_effect_has_words() -> None:
    assert all("_" not in plain_name(effect) for effect in effects())
