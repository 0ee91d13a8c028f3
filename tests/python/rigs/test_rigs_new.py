# SPDX-License-Identifier: MIT
"""Rigs of what an engineer knows: units, typical values, and what is read back."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ehsid.harness.rigs import parse_rig
from ehsid.harness.rigs.new import Entry, axis_entries, ehs_entries
from ehsid.harness.rigs.quantities import Quantity, read_quantity
from ehsid.harness.rigs.questions import answered
from ehsid.harness.rigs.rig_file import commented_text

# Units with their exact size in the unit of the rig.
EXACT = {
    ("mm", "m"): Fraction(1, 1000),
    ("cm", "m"): Fraction(1, 100),
    ("m", "m"): Fraction(1),
    ("inch", "m"): Fraction(254, 10000),
    ("bar", "Pa"): Fraction(10**5),
    ("MPa", "Pa"): Fraction(10**6),
    ("GPa", "Pa"): Fraction(10**9),
    ("kN", "N"): Fraction(1000),
    ("t", "kg"): Fraction(1000),
    ("cm³", "m^3"): Fraction(1, 10**6),
}
NUMBERS = st.decimals(min_value=Decimal("0.001"), max_value=Decimal(9999), places=3)

BENCH = {
    "bore": Quantity(0.063, "63 mm"),
    "rod": Quantity(0.035, "35 mm"),
    "stroke": Quantity(0.3, "300 mm"),
    "supply": Quantity(12e6, "120 bar"),
    "rated-flow": Quantity(38 / 60000, "38 l/min"),
}


def by_key(entries: list[Entry]) -> dict[str, Entry]:
    return {entry.key: entry for entry in entries}


@given(NUMBERS, st.sampled_from(sorted(EXACT)), st.sampled_from([" ", ""]), st.booleans())
def test_a_number_with_a_unit_is_exact(
    number: Decimal, unit: tuple[str, str], space: str, comma: bool
) -> None:
    text = str(number).replace(".", ",") if comma else str(number)
    read = read_quantity(f"{text}{space}{unit[0]}", "--x", "mm", unit[1])
    assert read.value == float(Fraction(number) * EXACT[unit])
    assert not read.assumed


@given(NUMBERS)
def test_a_flow_is_exact_to_the_last_digit(number: Decimal) -> None:
    read = read_quantity(f"{number} l/min", "--x", "l/min", "m^3/s")
    assert read.value == pytest.approx(float(Fraction(number) / 60000), rel=2.3e-16)


@given(NUMBERS)
def test_a_number_alone_has_the_usual_unit_and_says_so(number: Decimal) -> None:
    read = read_quantity(str(number), "--bore", "mm", "m")
    assert read == Quantity(float(Fraction(number) / 1000), f"{number} mm", assumed=True)


@pytest.mark.parametrize("sign", ["+-", "+/-", "±", " +- "])
def test_an_uncertainty_is_read(sign: str) -> None:
    read = read_quantity(f"120 kg{sign}20 %", "--mass", "kg", "kg")
    assert (read.value, read.sigma) == (120.0, pytest.approx(0.2))


@pytest.mark.slow
@given(st.text(max_size=90))
def test_any_text_is_a_quantity_or_a_message(text: str) -> None:
    try:
        found = read_quantity(text, "--bore", "mm", "m").value
    except ValueError as error:
        said = str(error)
    else:
        said = f"--bore expected {found}" if math.isfinite(found) else ""
    assert "--bore" in said
    assert "expected" in said


def test_a_command_keeps_its_number() -> None:
    for text, value in (("10 V", 10.0), ("20 mA", 20.0), ("100 %", 100.0)):
        assert read_quantity(text, "--rated-command", "V", "command").value == value


# A large cylinder with a tiny valve: the rule for viscous friction leaves the range of the plant.
@example(
    bore=Decimal("168.5"), rod=Decimal(0), stroke=Decimal(20), supply=Decimal(400),
    flow=Decimal(1), hoses=False, name="",
)  # fmt: skip
@given(
    bore=st.decimals(20, 300, places=1),
    rod=st.decimals(0, 19, places=1),
    stroke=st.decimals(20, 3000, places=0),
    supply=st.decimals(20, 400, places=0),
    flow=st.decimals(1, 500, places=1),
    hoses=st.booleans(),
    name=st.text(max_size=30),
)
def test_what_is_given_is_what_is_read_back(
    bore: Decimal, rod: Decimal, stroke: Decimal, supply: Decimal, flow: Decimal, hoses: bool,
    name: str,
) -> None:  # fmt: skip
    texts = {
        "bore": (f"{bore} mm", "m"),
        "rod": (f"{rod} mm", "m"),
        "stroke": (f"{stroke} mm", "m"),
        "supply": (f"{supply} bar", "Pa"),
        "rated-flow": (f"{flow} l/min", "m^3/s"),
    }
    known = {key: read_quantity(text, key, "", si) for key, (text, si) in texts.items()}
    entries = ehs_entries(known, double_rod=False, hoses=hoses)
    rig = parse_rig(commented_text(name, "ehs", entries))
    assert rig.name == name
    assert rig.values["cylinder.bore_m"] == float(bore / 1000)
    assert rig.values["cylinder.stroke_m"] == float(stroke / 1000)
    assert rig.values["supply.pressure_pa"] == float(supply * 100000)
    for entry in entries:
        if entry.key.startswith("sensors."):
            assert rig.sensors[entry.key.removeprefix("sensors.")] == entry.value
        else:
            assert rig.values[entry.key] == entry.value
            assert rig.uncertainty[entry.key] == entry.sigma


def test_what_is_not_known_is_typical_and_less_certain() -> None:
    entries = by_key(ehs_entries(BENCH, double_rod=False, hoses=False))
    assert entries["cylinder.bore_m"].given
    for key, least in (
        ("cylinder.dead_volume_a_m3", 0.3),
        ("fluid.bulk_modulus_pa", 0.3),
        ("load.mass_kg", 1.0),
        ("load.viscous_friction_n_s_m", 1.0),
        ("effects.valve_lag.bandwidth_hz", 0.3),
    ):
        assert not entries[key].given
        assert entries[key].sigma is not None
        assert entries[key].sigma >= least
        assert entries[key].why


def test_typical_values_admit_the_bench() -> None:
    """The values of examples/rigs/bench.toml are within two deviations, as factors."""
    entries = by_key(ehs_entries(BENCH, double_rod=False, hoses=False))
    for key, value in (
        ("cylinder.dead_volume_a_m3", 2.5e-4),
        ("cylinder.dead_volume_b_m3", 2.5e-4),
        ("fluid.bulk_modulus_pa", 1.1e9),
        ("load.mass_kg", 120.0),
        ("load.viscous_friction_n_s_m", 900.0),
        ("effects.valve_lag.bandwidth_hz", 70.0),
    ):
        sigma = entries[key].sigma
        assert sigma is not None
        assert abs(math.log(value / entries[key].value)) < 2.0 * sigma, key


def test_lines_and_hoses_count() -> None:
    lines = {"line-length": Quantity(2.0, "2 m"), "line-bore": Quantity(0.012, "12 mm")}
    entries = by_key(ehs_entries({**BENCH, **lines}, double_rod=False, hoses=True))
    swept = 0.25 * math.pi * 0.063**2 * 0.3
    line = 0.25 * math.pi * 0.012**2 * 2.0
    assert entries["cylinder.dead_volume_a_m3"].value == pytest.approx(line + 0.05 * swept)
    assert entries["fluid.bulk_modulus_pa"].value < 1e9


def test_a_rod_on_both_sides_gives_equal_areas() -> None:
    entries = by_key(ehs_entries(BENCH, double_rod=True, hoses=False))
    assert entries["cylinder.rod_m"].value == 0.0
    assert entries["cylinder.bore_m"].value ** 2 == pytest.approx(0.063**2 - 0.035**2)


def test_a_drop_over_both_edges_is_halved_and_an_empty_one_is_not() -> None:
    answers = {key: given.text for key, given in BENCH.items()}
    given = answered("ehs", answers | {"rated-drop": "70 bar"}, drop_over_both=True)
    assert by_key(given)["valve.rated_pressure_drop_pa"].value == 3.5e6
    answered("ehs", answers | {"rated-drop": " "}, drop_over_both=True)


def test_an_axis() -> None:
    known = {"mass": Quantity(95.0, "95 kg"), "force-gain": Quantity(35.15, "35.15 N/V")}
    rig = parse_rig(commented_text("axis", "axis", axis_entries(known)))
    assert rig.values["axis.mass_kg"] == 95.0
    assert rig.values["axis.force_per_volt"] == 35.15
    assert rig.sigma("axis.viscous_friction_n_s_m") == 1.0
