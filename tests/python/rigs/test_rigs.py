# SPDX-License-Identifier: MIT
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

import ehsid
from ehsid.harness.rigs import RigError, parse_rig, read_rig, rig_text, write_rig

RIGS = ROOT / "examples" / "rigs"
BENCH = (RIGS / "bench.toml").read_text(encoding="utf-8")
PARAMETERS = {p.name: p for p in ehsid.plant_parameters()}
MACHINE = [
    name
    for name in PARAMETERS
    if not name.startswith(("effects.", "nuisance.", "initial.", "axis.", "linear."))
]


def test_bench_is_read_with_defaults_for_what_it_does_not_tell() -> None:
    rig = read_rig(RIGS / "bench.toml")
    assert (rig.name, rig.plant) == ("bench", "ehs")
    assert rig.values["valve.rated_flow_m3_s"] == 6.33e-4
    assert rig.effects() == ("valve_lag",)
    assert rig.sigma("fluid.bulk_modulus_pa") == 0.3
    assert rig.sigma("load.mass_kg") == 0.05
    values = dict(zip(PARAMETERS, rig.plant_values(), strict=True))
    assert values["initial.position_m"] == 0.15
    assert values["effects.coulomb_friction.force_n"] == 0.0
    assert values["nuisance.flow_exponent"] == 0.5


def test_axis_needs_no_hydraulics() -> None:
    rig = read_rig(RIGS / "axis.toml")
    assert rig.plant == "axis"
    assert rig.values["axis.force_per_volt"] == 35.15


# Values without relations to others; values of a pair, such as rod and bore, can contradict.
ALONE = [name for name in PARAMETERS if name.startswith(("load.", "fluid.", "nuisance."))]
numbers = st.sampled_from(ALONE).flatmap(
    lambda name: st.tuples(
        st.just(name), st.floats(PARAMETERS[name].minimum, PARAMETERS[name].maximum)
    )
)


@given(other_values=st.lists(numbers, max_size=8))
def test_written_rig_reads_the_same(other_values: list[tuple[str, float]]) -> None:
    rig = read_rig(RIGS / "bench.toml").with_values(dict(other_values))
    rig_read = parse_rig(rig_text(rig))
    assert dict(rig_read.values) == dict(rig.values)
    assert dict(rig_read.uncertainty) == dict(rig.uncertainty)
    assert dict(rig_read.sensors) == dict(rig.sensors)


@pytest.mark.slow
@given(name=st.sampled_from(MACHINE), side=st.sampled_from([-1, 1]))
def test_every_value_outside_its_range_is_named(name: str, side: int) -> None:
    parameter = PARAMETERS[name]
    value = parameter.minimum - 1e-3 if side < 0 else parameter.maximum * 1.01
    rig = read_rig(RIGS / "bench.toml")
    with pytest.raises(RigError) as caught:
        rig.with_values({name: value})
    assert name in str(caught.value)
    assert f"{parameter.maximum:g}" in str(caught.value)


@pytest.mark.parametrize("name", MACHINE)
def test_every_missing_value_is_named(name: str) -> None:
    key = name.split(".")[1]
    section = name.split(".")[0]
    lines = BENCH.splitlines()
    start = lines.index(f"[{section}]")
    at = next(i for i in range(start, len(lines)) if lines[i].startswith(key))
    with pytest.raises(RigError) as caught:
        parse_rig("\n".join(lines[:at] + lines[at + 1 :]))
    assert [p for p in caught.value.problems if f"'{name}' is missing" in p]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("bore_m", "bore_mm"), "'cylinder.bore_mm' is not known; did you mean 'cylinder.bore_m'?"),
        (("rod_m = 0.035", "rod_m = 0.07"), "'cylinder.rod_m' = 0.07 must be below"),
        (("mass_kg = 120.0", 'mass_kg = "heavy"'), "'load.mass_kg' = 'heavy': expected a number"),
        (("mass_kg = 120.0", "mass_kg = true"), "'load.mass_kg' = true: expected a number"),
        (("mass_kg = 120.0", "mass_kg = inf"), "expected a finite number"),
        (("[effects.valve_lag]", "[effects.valve_leg]"), "did you mean 'valve_lag'?"),
        (("damping = 0.85", ""), "'effects.valve_lag.damping' is missing"),
        (("[load]", "[lode]"), "'lode' is not known; did you mean 'load'?"),
        (('"ehs"', '"boat"'), '\'plant\' = \'boat\': expected "ehs" or "axis" or "linear"'),
        (("= 0.3\n", "= -1.0\n"), "expected a relative 1-sigma"),
        (("position_noise_m", "noise"), "sensors: 'noise' is not known"),
        (
            ("tank_pressure_pa = 2.0e5", "tank_pressure_pa = 9.0e6\npressure = 1"),
            "'supply.pressure'",
        ),
        (("[fluid]", "[fluid"), "not TOML"),
        (('name = "bench"', "name = 3"), "'name' = 3: expected text"),
        (('name = "bench"', "axis = 3"), "'axis' = 3: expected a section [axis]"),
    ],
)
def test_wrong_rigs_are_refused_with_key_and_value(change: tuple[str, str], words: str) -> None:
    assert change[0] in BENCH
    with pytest.raises(RigError) as caught:
        parse_rig(BENCH.replace(*change, 1), source="my.toml")
    assert words in str(caught.value)
    assert str(caught.value).startswith("my.toml: ")


def test_all_problems_come_at_once() -> None:
    text = BENCH.replace("rod_m", "rot_m").replace("mass_kg = 120.0", "mass_kg = -1.0")
    with pytest.raises(RigError) as caught:
        parse_rig(text)
    assert len(caught.value.problems) == 3  # rod_m missing, rot_m not known, mass_kg out of range


def test_columns_map_names_and_units() -> None:
    text = BENCH + '\n[columns]\nposition_m = { name = "Stroke", unit = "mm" }\ncommand_v = "u"\n'
    columns = parse_rig(text).columns
    assert (columns["position_m"].name, columns["position_m"].unit) == ("Stroke", "mm")
    assert (columns["command_v"].name, columns["command_v"].unit) == ("u", None)
    for mapping, words in (
        ('{ name = "S", unit = "kg" }', "expected a unit of the same kind as m"),
        ('{ name = "S", unit = "furlongs per" }', "expected a unit of the same kind as m"),
        ("{ unit = 1 }", 'expected { name = "Stroke", unit = "mm" }'),
        ('{ name = "S", scale = 2 }', "'scale' is not known"),
    ):
        with pytest.raises(RigError) as caught:
            parse_rig(f"{BENCH}\n[columns]\nposition_m = {mapping}\n")
        assert words in str(caught.value)


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(RigError, match="no such file"):
        read_rig(tmp_path / "none.toml")
    with pytest.raises(RigError, match="directory"):
        read_rig(tmp_path)
    (tmp_path / "latin.toml").write_bytes('name = "Prüfstand"'.encode("latin-1"))
    with pytest.raises(RigError, match="UTF-8"):
        read_rig(tmp_path / "latin.toml")


def test_writing_is_whole_or_not_at_all(tmp_path: Path) -> None:
    rig = read_rig(RIGS / "bench.toml")
    write_rig(rig, tmp_path / "rig.toml")
    assert dict(read_rig(tmp_path / "rig.toml").values) == dict(rig.values)
    with pytest.raises(RigError, match="cannot be written"):
        write_rig(rig, tmp_path / "none" / "rig.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["rig.toml"]


def test_rigs_are_values() -> None:
    rig = read_rig(RIGS / "bench.toml")
    other = rig.with_values({"load.mass_kg": 50.0})
    assert rig.values["load.mass_kg"] == 120.0
    changed = [
        name
        for name, before, after in zip(
            PARAMETERS, rig.plant_values(), other.plant_values(), strict=True
        )
        if before != after and not (np.isnan(before) and np.isnan(after))
    ]
    assert changed == ["load.mass_kg"]
