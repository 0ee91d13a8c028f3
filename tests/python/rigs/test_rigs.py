# SPDX-License-Identifier: MIT

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

import ehsid
from ehsid.harness.rigs import parse_rig, read_rig, rig_text

RIGS = ROOT / "examples" / "rigs"
BENCH = (RIGS / "bench.toml").read_text(encoding="utf-8")
PARAMETERS = {p.name: p for p in ehsid.plant_parameters()}


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


def test_columns_map_names_and_units() -> None:
    text = BENCH + '\n[columns]\nposition_m = { name = "Stroke", unit = "mm" }\ncommand_v = "u"\n'
    columns = parse_rig(text).columns
    assert (columns["position_m"].name, columns["position_m"].unit) == ("Stroke", "mm")
    assert (columns["command_v"].name, columns["command_v"].unit) == ("u", None)


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
