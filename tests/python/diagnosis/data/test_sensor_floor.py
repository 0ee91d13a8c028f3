# SPDX-License-Identifier: MIT
"""Noise floor of slowly sampled records, in which motion hides the noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from sources import ROOT

from ehsid.harness.diagnosis.data.floor import (
    DESIGN_PRESSURE_NOISE,
    NOISE_OF_RANGE,
    NOISE_OF_STROKE,
    SPRING_HIDES_NOISE,
    floor_of,
    sensor_floor,
)
from ehsid.harness.diagnosis.data.repeats import oil_spring_hz
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

BENCH = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
NOISE = {"position_noise_m": 1e-5, "pressure_a_noise_pa": 1e4, "spool_noise": 1e-3}


def measured(dt_s: float, sensors: Mapping[str, float] = NOISE) -> tuple[Rig, Record]:
    rig = replace(BENCH, sensors=sensors)
    samples = round(20.0 / dt_s)
    rng = np.random.default_rng(4)
    command = multisine(samples, dt_s, band_hz=(0.3, 6.0), peak=3.0, rng=rng)
    noise = draw_noise(replace(BENCH, sensors=NOISE), samples, rng)
    return rig, simulate(rig, command, dt_s=dt_s, noise=noise).record


def test_a_record_that_follows_the_oil_spring_keeps_its_own_estimate() -> None:
    rig, record = measured(1e-3)
    for name in ("position_m", "pressure_a_pa"):
        assert sensor_floor(record, name, rig) == floor_of(record, name)
    assert sensor_floor(record, "position_m", rig).seen


@pytest.mark.parametrize("dt_s", [0.02, 0.05])
def test_a_slow_record_has_the_noise_that_the_rig_file_tells(dt_s: float) -> None:
    rig, record = measured(dt_s)
    spring_hz = oil_spring_hz(rig)
    assert spring_hz is not None
    assert spring_hz * dt_s > SPRING_HIDES_NOISE
    for name, key in (("position_m", "position_noise_m"), ("pressure_a_pa", "pressure_a_noise_pa")):
        floor = sensor_floor(record, name, rig)
        assert floor.value == NOISE[key]
        # The differences show motion: they stay as the upper end.
        assert floor.high >= floor_of(record, name).value > NOISE[key]
        assert floor.low <= floor.value
        assert not floor.seen


def test_differences_that_show_motion_do_not_show_the_noise() -> None:
    assert not floor_of(measured(0.05)[1], "position_m").seen
    assert floor_of(measured(1e-3)[1], "position_m").seen


def test_a_slow_record_without_stated_noise_has_that_of_usual_sensors() -> None:
    rig, record = measured(0.05, {})
    expected = {
        "position_m": NOISE_OF_STROKE * rig.values["cylinder.stroke_m"],
        "pressure_b_pa": DESIGN_PRESSURE_NOISE * rig.values["supply.pressure_pa"],
        "spool": NOISE_OF_RANGE * float(np.ptp(record.column("spool"))),
    }
    for name, value in expected.items():
        assert sensor_floor(record, name, rig).value == pytest.approx(value)


def test_the_estimate_from_the_record_is_never_exceeded() -> None:
    rig, record = measured(0.05, {"position_noise_m": 1.0})
    floor = floor_of(record, "position_m")
    assert sensor_floor(record, "position_m", rig).value == floor.value


def test_stretches_at_rest_show_the_noise_at_any_sampling() -> None:
    rig, record = measured(0.05, {})
    rng = np.random.default_rng(5)
    columns = {name: np.array(column) for name, column in record.columns.items()}
    columns["command_v"][200:] = 0.0
    columns["position_m"][200:] = columns["position_m"][200] + 1e-5 * rng.standard_normal(
        len(record) - 200
    )
    still = replace(record, columns=columns)
    # Of 10 s at rest, the rms of 200 samples scatters by a twentieth.
    floor = sensor_floor(still, "position_m", rig)
    assert floor.value == pytest.approx(1e-5, rel=0.2)
    assert floor.seen
