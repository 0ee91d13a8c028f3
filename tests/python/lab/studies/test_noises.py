# SPDX-License-Identifier: MIT
"""The study of which recursion is right with which noise."""

import numpy as np
import pytest

from ehsid.lab.studies.noises import (
    NOISES,
    THETA,
    batch,
    bound,
    gradient,
    on_noisy_sensor,
    run,
    signals,
    simulated,
)

EQUATION, COLOURED, SENSOR = NOISES[0], NOISES[1], NOISES[3]


def test_the_noise_is_where_and_as_large_as_it_says() -> None:
    record = signals(SENSOR, 1, n=100_000)
    fit = 100.0 * (1.0 - np.std(record.y - record.x) / np.std(record.x))
    assert fit == pytest.approx(97.0, abs=0.05)
    white = signals(EQUATION, 1, n=100_000)
    residual = np.convolve(white.y - white.x, [1.0, *THETA[:3]])[: white.y.size]
    # The deviation of 1e5 samples of white noise is known to 1 / sqrt(2e5) = 0.2 %.
    assert np.std(residual) == pytest.approx(0.05, rel=0.01)


def test_gradient_is_the_derivative() -> None:
    u = signals(SENSOR, 2, n=300).u
    step = 1e-6
    for i, column in enumerate(gradient(THETA, u).T):
        moved = step * (np.arange(6) == i)
        slope = (simulated(THETA + moved, u) - simulated(THETA - moved, u)) / (2.0 * step)
        np.testing.assert_allclose(column, slope, atol=1e-6 * np.max(np.abs(column)))


def test_the_whole_record_reaches_the_bound() -> None:
    record = signals(SENSOR, 3)
    theta, deviation = batch(record)
    least = np.sqrt(np.diag(bound(record)))
    # sigma is estimated from 2000 samples, to 1.6 %.
    np.testing.assert_allclose(deviation, least, rtol=0.1)
    assert np.max(np.abs(theta - THETA) / least) < 4.5


@pytest.mark.parametrize(
    ("method", "noise"),
    [("rls", EQUATION), ("riv", SENSOR)],
)
def test_intervals_hold_where_the_model_of_the_noise_is_right(method: str, noise: object) -> None:
    assert noise in NOISES
    found = run(method, noise, range(40))  # type: ignore[arg-type]
    # 240 intervals of 90 %, in effect not fewer than 40: four deviations below are 71 %.
    assert found.coverage > 0.75
    assert found.within_three > 0.8
    assert found.error < 0.05


def test_least_squares_is_wrong_with_a_noisy_sensor_and_instruments_are_not() -> None:
    found = on_noisy_sensor(range(20))
    for name, runs in found.items():
        if name.startswith("least squares"):
            assert runs.coverage < 0.5
            assert runs.error > 0.3
    assert found["instrumental variables"].error < 0.05
