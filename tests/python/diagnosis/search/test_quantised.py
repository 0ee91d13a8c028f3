# SPDX-License-Identifier: MIT
from collections.abc import Sequence
from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.search.maps import position_step
from ehsid.harness.records import Record, make_record

FINE = made.record({}, 1)


def rounded(step_m: float, noise_m: float = 0.0, seed: int = 0) -> Record:
    """The same record from a sensor that adds noise and then rounds to steps."""
    columns = {name: FINE.column(name) for name in FINE.columns} | {"time_s": FINE.time_s}
    noise = noise_m * np.random.default_rng(seed).standard_normal(len(FINE))
    columns["position_m"] = step_m * np.rint((columns["position_m"] + noise) / step_m)
    return make_record(columns)


def case(records: Sequence[Record], **sensors: float) -> Case:
    return make_case(replace(made.RIG, sensors=sensors), records)


@settings(max_examples=15)
@given(step=st.floats(5e-5, 3e-4))
def test_a_coarse_step_is_read_from_the_record(step: float) -> None:
    estimate = position_step(case([rounded(step)]))
    assert estimate is not None
    # The levels are exact up to rounding of doubles; the interval allows for digits of a file.
    assert estimate.value == pytest.approx(step, rel=1e-6)
    assert estimate.low <= step <= estimate.high


def test_steps_show_where_motion_hides_the_noise() -> None:
    """A growing motion that looks like noise: the floor is above the steps, but not everywhere."""
    time = 1e-3 * np.arange(4000)
    command = np.random.default_rng(1).standard_normal(time.size) * (time / time[-1]) ** 2
    moved = 0.15 + 1e-3 * command + 0.05 * np.sin(9.0 * time)
    columns = {"time_s": time, "command_v": command, "position_m": 1e-4 * np.rint(moved / 1e-4)}
    subject = case([make_record(columns)])
    assert subject.floors["position_m"].value > 1e-4
    estimate = position_step(subject)
    assert estimate is not None
    assert estimate.value == pytest.approx(1e-4, rel=1e-6)
    assert position_step(case([make_record(columns | {"position_m": moved})])) is None


def test_steps_below_the_noise_are_no_effect() -> None:
    # 2e-5 / sqrt(12) is a quarter of the noise.
    assert position_step(case([rounded(2e-5, noise_m=2.5e-5)])) is None


def test_steps_of_the_stated_noise_or_of_any_sensor_are_no_effect() -> None:
    coarse = [rounded(1e-4)]
    # 1e-4 / sqrt(12) = 2.9e-5.
    assert position_step(case(coarse, position_noise_m=2.9e-5)) is None
    assert position_step(case(coarse, position_noise_m=1e-5)) is not None
    stroke = made.RIG.values["cylinder.stroke_m"]
    assert position_step(case([rounded(5e-5 * stroke)])) is None


def test_an_excluded_or_configured_effect_is_not_reported() -> None:
    subject = case([rounded(1e-4)])
    assert position_step(subject, ["sensor_quantisation"]) is None
    configured = made.RIG.with_values({"effects.sensor_quantisation.step_m": 1e-4})
    assert position_step(replace(subject, rig=configured)) is None


def test_all_records_must_show_it() -> None:
    assert position_step(case([rounded(1e-4), rounded(1.5e-4)])) is None
    assert position_step(case([rounded(1e-4), FINE])) is None
