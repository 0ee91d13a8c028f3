# SPDX-License-Identifier: MIT
"""What everyone tries first: simulate the example bench with an effect, then diagnose it.

With all sensors noisy, with the position noisy only, and without any noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from sources import ROOT

from ehsid.harness.diagnosis import diagnose
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

pytestmark = pytest.mark.thorough

BENCH = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
NOISE: dict[str, Mapping[str, float]] = {
    "all": BENCH.sensors,
    "position": {"position_noise_m": 1e-5},
    "none": {},
}
FRICTION = {"effects.coulomb_friction.force_n": 400.0}
TWO = {"effects.coulomb_friction.force_n": 350.0, "effects.valve_dead_band.overlap": 0.03}


def record(values: Mapping[str, float], noise: str, dt_s: float = 1e-3) -> tuple[Rig, Record]:
    """A multisine in an open loop, 12 s at 1 kHz, 30 s at slower sampling."""
    rig = replace(BENCH, sensors=NOISE[noise])
    samples = round((12.0 if dt_s < 0.01 else 30.0) / dt_s)
    rng = np.random.default_rng(16)
    command = multisine(samples, dt_s, band_hz=(0.3, min(8.0, 0.4 / dt_s)), peak=2.5, rng=rng)
    drawn = draw_noise(rig, samples, rng) if rig.sensors else None
    return rig, simulate(rig, command, dt_s=dt_s, values=values, noise=drawn).record


# Each machine and each noise, but not all pairs of them: a pair takes 15 to 30 s.
@pytest.mark.parametrize(
    ("values", "dt_s", "noise"),
    [
        (TWO, 1e-3, "all"),
        ({}, 1e-3, "none"),
        (FRICTION, 0.05, "position"),
    ],
)
def test_the_effect_is_named_with_its_size(
    values: Mapping[str, float], dt_s: float, noise: str
) -> None:
    rig, measured = record(values, noise, dt_s)
    diagnosis = diagnose([measured], rig)
    assert diagnosis.verdict == ("effects" if values else "no_gap"), diagnosis.sentence
    sizes = {
        f"effects.{effect.id}.{name}": size
        for effect in diagnosis.effects
        for name, size in effect.parameters.items()
    }
    assert sizes.keys() == values.keys()
    for name, value in values.items():
        # The simulator that made the record is the one that is fitted.
        assert sizes[name].value == pytest.approx(value, rel=0.02)
        assert sizes[name].low <= value <= sizes[name].high
