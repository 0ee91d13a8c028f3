# SPDX-License-Identifier: MIT
"""Spikes of the output: found, told from pushes, interpolated; the rest untouched."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_truth import A16, B16, arx_output, model16

from ehsid.harness.models.identification import IoData, Outliers, replace_outliers

NOISE = 0.1


def clean(y: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, Outliers]:
    data = IoData.from_arrays(u, y)
    return replace_outliers(data, data.split(0.5)[0])


@pytest.mark.slow
@settings(max_examples=30)
@given(
    seed=st.integers(0, 2**32 - 1),
    # Apart by more than the reach of a spike, in both halves, at the last sample too.
    places=st.lists(st.integers(3, 99), min_size=1, max_size=6, unique=True),
    size=st.floats(10.0, 1e4),
    sign=st.sampled_from([-1.0, 1.0]),
    scale=st.floats(1e-3, 1e3),
)
def test_spikes_are_found_and_put_back(
    seed: int, places: list[int], size: float, sign: float, scale: float
) -> None:
    u, y = model16(seed=seed, n=1000, noise=NOISE)
    at = np.array(sorted(places)) * 10 + 9
    spoilt = y.copy()
    # A spike is seen by |h| = sqrt(1 + a'a) = 3.06; only its first residual is there at the end.
    spoilt[at] += sign * size * NOISE * (1.0 + (at == 999))
    repaired, report = clean(scale * spoilt, u)
    np.testing.assert_array_equal(report.positions, at)
    np.testing.assert_array_equal(report.recorded, scale * spoilt[at])
    others = np.setdiff1d(np.arange(1000), at)
    np.testing.assert_array_equal(repaired[others], scale * spoilt[others])
    # Interpolated to noise / |h|, at the end to the noise: six of them within 5 sigma, missed once
    # in 3 10^5. Half as much again for the model, which is an estimate.
    error = np.abs(repaired[at] / scale - y[at])
    assert (error < 7.5 * NOISE / np.where(at == 999, 1.0, 3.06)).all()


@pytest.mark.thorough
def test_false_alarms_are_as_rare_as_promised() -> None:
    """1 % a record for tails of t7, normal noise has far fewer: none in 200 records is certain."""
    alarms = {"t7": 0, "normal": 0}
    for seed in range(200):
        rng = np.random.default_rng(seed)
        u = rng.normal(size=600)
        for name, e in (("t7", rng.standard_t(7, size=600)), ("normal", rng.normal(size=600))):
            _, report = clean(arx_output(A16, B16, 1, u, NOISE * e), u)
            alarms[name] += report.positions.size > 0
    assert alarms["normal"] == 0
    # A rate of 1 % gives more than this once in a thousand times.
    assert alarms["t7"] <= scipy.stats.binom.isf(1e-3, 200, 0.01)


def test_threshold_is_that_of_its_false_alarm_rate() -> None:
    u, y = model16(seed=1, n=504, noise=NOISE)
    _, report = clean(y, u)
    assert report.n_examined == 500
    # In units of a deviation told from the median: P(|t7| > q) = 1 % / 500.
    scale = scipy.stats.t.ppf(0.75, 7) / scipy.stats.norm.ppf(0.75)
    assert 2 * scipy.stats.t.sf(report.threshold * scale, 7) == pytest.approx(0.01 / 500)
    assert "none of 500 samples" in report.text


def test_pushes_and_steps_are_no_outliers() -> None:
    rng = np.random.default_rng(2)
    u, e = rng.normal(size=1000), NOISE * rng.normal(size=1000)
    u[400:] += 20.0  # a step command
    e[[150, 700]] += 40.0 * NOISE  # pushes of the process
    y = arx_output(A16, B16, 1, u, e)
    repaired, report = clean(y, u)
    assert report.positions.size == 0
    np.testing.assert_array_equal(repaired, y)


def test_too_many_are_the_process() -> None:
    rng = np.random.default_rng(3)
    u, y = model16(seed=3, n=1000, noise=NOISE)
    y[rng.choice(1000, 15, replace=False)] += 100.0 * NOISE
    repaired, report = clean(y, u)
    np.testing.assert_array_equal(repaired, y)
    assert report.positions.size == 0
    assert "the process or its noise" in report.text


@pytest.mark.parametrize("kind", ["exact", "stepped", "still"])
def test_data_without_noise_have_no_outliers(kind: str) -> None:
    u, y = model16(seed=4, n=600, noise=0.0)
    if kind == "stepped":
        y = 0.5 * np.round(y / 0.5)
    elif kind == "still":
        u[100:500] = 0.0  # most residuals are exactly zero
        y = 0.05 * np.round(arx_output(np.array([-0.5]), np.array([1.0]), 1, u, 0.0 * u) / 0.05)
    repaired, report = clean(y, u)
    assert report.positions.size == 0
    np.testing.assert_array_equal(repaired, y)


def test_too_short_a_record_is_left_alone() -> None:
    u, y = model16(seed=5, n=30)
    repaired, report = clean(y, u)
    np.testing.assert_array_equal(repaired, y)
    assert report.n_examined == 0
    assert "not looked for" in report.text
