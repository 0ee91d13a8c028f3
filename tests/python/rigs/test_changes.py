# SPDX-License-Identifier: MIT
"""What differs between two rigs."""

from __future__ import annotations

import pytest
from sources import ROOT

from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.rig_file import changes

BENCH = ROOT / "examples" / "rigs" / "bench.toml"


@pytest.fixture(scope="module")
def bench() -> Rig:
    return read_rig(BENCH)


def test_a_rig_does_not_differ_from_itself(bench: Rig) -> None:
    assert changes(bench, bench) == []


def test_moved_added_and_missing_values_are_found(bench: Rig) -> None:
    force = "effects.coulomb_friction.force_n"
    after = bench.with_values({"load.mass_kg": 132.0, force: 400.0})
    moved, added = changes(bench, after)
    assert (moved.key, moved.before, moved.after) == ("load.mass_kg", 120.0, 132.0)
    assert moved.share == pytest.approx(0.1)
    assert (added.key, added.before, added.after, added.share) == (force, None, 400.0, None)
    gone = changes(after, bench)[-1]
    assert (gone.key, gone.before, gone.after) == (force, 400.0, None)


def test_small_changes_are_left_out_where_this_is_asked_for(bench: Rig) -> None:
    after = bench.with_values({"load.mass_kg": 120.06})
    assert len(changes(bench, after, least=1e-4)) == 1
    assert changes(bench, after, least=1e-3) == []


def test_a_value_that_was_nothing_has_no_share(bench: Rig) -> None:
    before = bench.with_values({"nuisance.null_bias": 0.0})
    (change,) = changes(before, bench.with_values({"nuisance.null_bias": 0.001}))
    assert change.share is None
