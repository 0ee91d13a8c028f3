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
    FLOORS_DIFFER,
    NOISE_OF_RANGE,
    NOISE_OF_STROKE,
    SPRING_HIDES_NOISE,
    floor_of,
    machine_floor,
    sensor_floor,
)
from ehsid.harness.diagnosis.data.repeats import oil_spring_hz
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.traces.findings import prepared
from ehsid.harness.diagnosis.traces.match import Matched
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


def shaken(record: Record, sigma_m: float, colour: float = 0.0) -> Record:
    """The record with a position that also moves as fast as the samples, like white noise.

    colour: share of the error of the sample before that is added to each.
    """
    error = sigma_m * np.random.default_rng(6).standard_normal(len(record))
    error[1:] += colour * error[:-1]
    columns = {**record.columns, "position_m": record.column("position_m") + error}
    return replace(record, columns=columns)


def at_rest(record: Record, noise_m: float) -> Record:
    """The record with a rod that stands still in its last 30 %, with noise of the sensor."""
    first = round(0.7 * len(record))
    columns = {name: np.array(column) for name, column in record.columns.items()}
    noise = noise_m * np.random.default_rng(5).standard_normal(len(record) - first)
    columns["command_v"][first:] = 0.0
    columns["position_m"][first:] = columns["position_m"][first] + noise
    return replace(record, columns=columns)


def test_stretches_at_rest_show_the_noise_at_any_sampling() -> None:
    rig, record = measured(0.05, {})
    still = at_rest(shaken(record, 1e-3), 1e-5)
    # The differences show motion that passes for noise in most of the record.
    assert floor_of(still, "position_m").value > 1e-4
    # Samples that are late by up to 2 % of the sampling time move with the rod.
    late = 0.02 / np.sqrt(12.0) * np.sqrt(np.mean(np.diff(still.column("position_m")) ** 2))
    assert late > 5e-6
    # The rms of 120 samples at rest scatters by 6 %.
    floor = sensor_floor(still, "position_m", rig)
    assert floor.value == pytest.approx(np.hypot(1e-5, late), rel=0.1)
    assert floor.seen


def test_samples_that_could_be_late_add_no_more_than_the_record_shows() -> None:
    """A slow motion leaves nothing in the differences, so that they show what each sample does."""
    rig, record = measured(0.05, {})
    slow = 0.1 * np.sin(2.0 * np.pi * 0.3 * 0.05 * np.arange(len(record)))
    moving = shaken(replace(record, columns={**record.columns, "position_m": slow}), 1e-5)
    still = at_rest(moving, 1e-5)
    late = 0.02 / np.sqrt(12.0) * np.sqrt(np.mean(np.diff(still.column("position_m")) ** 2))
    assert late > 3e-5
    assert sensor_floor(still, "position_m", rig).value == pytest.approx(1e-5, rel=0.2)


def test_motion_of_one_record_is_not_the_noise_of_a_machine() -> None:
    rig, record = measured(0.05, {"position_noise_m": 1e-4})
    moving = shaken(record, 1e-3)
    still, quiet = at_rest(record, 5e-5), at_rest(record, 5e-6)
    floor = sensor_floor(moving, "position_m", rig)
    assert floor.value > FLOORS_DIFFER * sensor_floor(quiet, "position_m", rig).value
    assert machine_floor([moving, quiet], "position_m", rig) == sensor_floor(
        quiet, "position_m", rig
    )
    # Within FLOORS_DIFFER the largest one counts, as it does where no record shows the noise.
    assert floor.value < FLOORS_DIFFER * sensor_floor(still, "position_m", rig).value
    assert machine_floor([moving, still], "position_m", rig) == floor
    assert machine_floor([moving, moving], "position_m", rig) == floor


@pytest.mark.parametrize(("colour", "is_noise"), [(0.0, True), (0.7, False)])
def test_a_tenfold_noise_counts_if_it_is_white(colour: float, is_noise: bool) -> None:
    rig, record = measured(1e-3)
    noisy = shaken(record, 1e-4, colour)
    quiet_floor, noisy_floor = (sensor_floor(each, "position_m", rig) for each in (record, noisy))
    assert noisy_floor.seen
    assert noisy_floor.value > FLOORS_DIFFER * quiet_floor.value
    expected = noisy_floor if is_noise else quiet_floor
    assert machine_floor([record, noisy], "position_m", rig) == expected


def test_cases_and_traces_have_the_noise_of_the_machine() -> None:
    rig, record = measured(1e-3)
    records = [record, shaken(record, 1e-4, 0.7)]
    expected = machine_floor(records, "position_m", rig)
    assert expected != sensor_floor(records[1], "position_m", rig)
    assert make_case(rig, records, records).floors["position_m"] == expected
    trace = {"position_m": record.column("position_m")}
    data = prepared([Matched(each, trace) for each in records], rig)
    assert data.floors["position_m"] == expected
