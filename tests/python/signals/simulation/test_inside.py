# SPDX-License-Identifier: MIT
"""A command that would drive the rod to an end is made so small that it does not."""

from __future__ import annotations

import numpy as np
import pytest
from sources import ROOT

from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import inside_stroke, simulate

RIGS = ROOT / "examples" / "rigs"


@pytest.mark.parametrize("peak", [0.5, 9.0])
def test_the_rod_stays_inside_its_stroke(peak: float) -> None:
    bench = read_rig(RIGS / "bench.toml")
    wish = peak * np.sin(2.0 * np.pi * 0.5 * 1e-3 * np.arange(4000))
    kept = inside_stroke(bench, wish, 1e-3)
    position = simulate(bench, kept, dt_s=1e-3).record.column("position_m")
    assert position.min() > 0.0
    assert position.max() < 0.3
    # A command that is small enough keeps its size.
    assert (np.abs(kept).max() < 0.9 * peak) == (peak > 1.0)


def test_a_machine_without_a_stroke_gets_the_command_as_it_is() -> None:
    wish = np.full(3000, 8.0)
    assert inside_stroke(read_rig(RIGS / "axis.toml"), wish, 1e-3) is wish
