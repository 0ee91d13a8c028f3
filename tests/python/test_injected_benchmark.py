# SPDX-License-Identifier: MIT
"""benchmarks/gap_injected.py: every effect that can be put in has sizes there."""

from __future__ import annotations

import pytest
from sources import ROOT

from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.injection import injectable

EMPS = ROOT / "tests" / "python" / "data" / "emps"


@pytest.mark.parametrize(
    ("put_in", "own", "named", "right"),
    [
        ("valve_lag", set(), {"valve_lag"}, True),
        ("valve_lag", {"load_force"}, {"load_force", "valve_lag"}, True),
        ("valve_lag", set(), set(), False),
        ("valve_lag", set(), {"valve_lag", "sensor_lag"}, False),
        ("valve_dead_band_sides", set(), {"valve_dead_band", "valve_null_bias"}, True),
        ("valve_dead_band_sides", set(), {"valve_dead_band"}, False),
        ("valve_dead_band", set(), {"valve_dead_band_sides"}, False),
        ("load_force", {"coulomb_friction"}, {"load_force", "position_friction"}, True),
    ],
)
def test_what_counts_as_named_right(
    put_in: str, own: set[str], named: set[str], right: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    from gap_injected import is_right

    assert is_right(named, own, [put_in]) is right


@pytest.mark.parametrize("plant", ["ehs", "axis"])
def test_each_effect_has_sizes_within_its_limits(
    plant: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    from gap_injected import sizes_of

    record, rig = read_record(EMPS / "emps.csv"), read_rig(EMPS / "emps.rig.toml")
    for effect, limits in injectable(plant).items():
        for sizes in sizes_of(effect, record, rig):
            assert sizes.keys() == limits.keys(), effect
            for name, size in sizes.items():
                assert limits[name][0] <= size <= limits[name][1], (effect, name)
