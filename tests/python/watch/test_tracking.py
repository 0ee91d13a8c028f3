# SPDX-License-Identifier: MIT
"""What one log tells of a machine that wears, made by the independent generator."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.watch.tracking import GAP, WEAR, Estimated, estimated, tracked_effects
from ehsid.lab.reality.effects import Sizes
from ehsid.lab.reality.lives import make_life

DEAD_BAND = "effects.valve_dead_band.overlap"
LEAK = "effects.internal_leakage.coefficient_m3_s_pa"


def machine(folder: Path, sizes: Mapping[str, Sizes], seed: int = 12) -> tuple[Rig, list[Record]]:
    text, logs = make_life(seed, [0.0, 1.0, 2.0], lambda _: sizes, seconds=4.0)
    (folder / "rig.toml").write_text(text)
    return read_rig(folder / "rig.toml"), [
        make_record(dict(log.columns), name=f"day {log.day:g}") for log in logs
    ]


def told(record: Record, rig: Rig) -> dict[str, Estimated]:
    found = estimated(record, rig, tracked_effects(rig))
    assert found.refused == ""
    return {each.quantity: each for each in found.estimates}


def test_each_log_tells_the_sizes_that_the_machine_has(tmp_path: Path) -> None:
    sizes = {
        "valve_dead_band": {"overlap": 0.03},
        "internal_leakage": {"coefficient_m3_s_pa": 2e-11},
    }
    rig, logs = machine(tmp_path, sizes)
    for log in logs:
        found = told(log, rig)
        # Within a few of its own deviations, and what the simulator is wrong by: a tenth.
        for name, true in ((DEAD_BAND, 0.03), (LEAK, 2e-11)):
            assert found[name].value == pytest.approx(
                true, rel=0.1, abs=4.0 * found[name].deviation
            )
            assert 0.0 < found[name].deviation < 0.2 * true
        assert found[GAP].value > 0.0


def test_a_sound_machine_has_small_sizes_with_their_deviations(tmp_path: Path) -> None:
    rig, logs = machine(tmp_path, {})
    for log in logs:
        found = told(log, rig)
        assert found[DEAD_BAND].value < 0.003
        assert found[LEAK].value < 5e-12
        # The end of its range is no reason to trust a size without limit.
        assert min(found[DEAD_BAND].deviation, found[LEAK].deviation) > 0.0


def test_effects_of_the_rig_file_are_not_watched(tmp_path: Path) -> None:
    rig, _ = machine(tmp_path, {})
    assert tracked_effects(rig) == WEAR
    with_leak = (tmp_path / "rig.toml").read_text() + (
        "\n[effects.internal_leakage]\ncoefficient_m3_s_pa = 1e-12\n"
    )
    (tmp_path / "with_leak.toml").write_text(with_leak)
    left = tracked_effects(read_rig(tmp_path / "with_leak.toml"))
    assert left == tuple(effect for effect in WEAR if effect != "internal_leakage")


def test_a_log_at_rest_is_refused_with_the_reason(tmp_path: Path) -> None:
    rig, (log, *_) = machine(tmp_path, {})
    still = {name: np.full_like(log.column(name), log.column(name)[0]) for name in log.columns}
    still["time_s"] = np.asarray(log.time_s)
    found = estimated(make_record(still), rig, WEAR)
    assert found.estimates == ()
    assert "command" in found.refused or "position" in found.refused
