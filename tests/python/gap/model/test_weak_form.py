# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.gap.model.weak_form import WeakForm, regress

DT_S = 1e-3
TIME_S = np.arange(2000) * DT_S


@given(frequency_hz=st.floats(0.1, 8.0), phase=st.floats(0.0, 6.0))
def test_slopes_are_means_of_the_derivatives(frequency_hz: float, phase: float) -> None:
    weak = WeakForm(DT_S)
    w = 2.0 * np.pi * frequency_hz
    sine, cosine = np.sin(w * TIME_S + phase), np.cos(w * TIME_S + phase)
    # The rule is exact for parabolas. Its error is proportional to (w 10 ms)^2 times the error of
    # the trapezoidal rule with 20 intervals, about 1e-4 for psi' and 3e-3 for psi''.
    np.testing.assert_allclose(weak.slope(sine), w * weak.mean(cosine), atol=1e-4 * w)
    np.testing.assert_allclose(weak.curvature(sine), -(w**2) * weak.mean(sine), atol=1e-3 * w**2)


def test_means_are_weighted_means() -> None:
    weak = WeakForm(DT_S)
    np.testing.assert_allclose(weak.mean(np.full(TIME_S.size, 3.0)), 3.0)
    # The weights are even: the mean of a straight line is its value at the middle.
    np.testing.assert_allclose(
        weak.mean(TIME_S), TIME_S[weak.centres(TIME_S.size)], rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(weak.slope(TIME_S), 1.0)
    np.testing.assert_allclose(weak.curvature(0.5 * TIME_S**2), 1.0, rtol=1e-6)


@given(
    samples=st.integers(0, 300),
    first=st.integers(0, 50),
    dt_s=st.sampled_from([1e-4, 5e-4, 1e-3, 1e-2, 5e-2]),
)
def test_one_number_for_each_centre(samples: int, first: int, dt_s: float) -> None:
    weak = WeakForm(dt_s, first=first)
    centres = weak.centres(samples)
    for integral in (weak.mean, weak.slope, weak.curvature):
        assert integral(np.ones(samples)).size == centres.size
    if centres.size:
        assert centres[0] - weak.length // 2 == first
        assert centres[-1] + weak.length // 2 < samples


def test_noise_of_a_slope_is_that_of_its_weights() -> None:
    """White noise of deviation s gives slopes of deviation s |psi'| dt, not s / dt."""
    weak = WeakForm(DT_S)
    impulse = np.zeros(101)
    impulse[50] = 1.0
    # An impulse at each sample of a test function gives all weights of psi'.
    weights = [float(weak.slope(np.roll(impulse, k - 50))[0]) for k in range(weak.length + 1)]
    noise = np.random.default_rng(0).standard_normal(200_000)
    slopes = np.std(weak.slope(noise))
    assert slopes == pytest.approx(np.sqrt(np.sum(np.square(weights))), rel=0.02)
    assert slopes < 0.2 / DT_S


@given(scale=st.floats(1e-6, 1e6), seed=st.integers(0, 100))
def test_regression_is_that_of_lstsq_whatever_the_units(scale: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns, rows = rng.standard_normal((50, 3)), rng.standard_normal(50)
    expected = np.linalg.lstsq(columns, -rows, rcond=None)[0]
    estimate = regress(rows, columns * scale, np.zeros(3), np.zeros(3))
    np.testing.assert_allclose(estimate * scale, expected, rtol=1e-8, atol=1e-10)


def test_a_strong_prior_holds() -> None:
    rng = np.random.default_rng(0)
    columns, rows = rng.standard_normal((50, 2)), rng.standard_normal(50)
    centre = np.array([3.0, -1.0])
    estimate = regress(rows, columns, centre, np.full(2, 1e12))
    np.testing.assert_allclose(estimate, centre, rtol=1e-6)
    # The prior adds rows to ordinary least squares.
    weight = np.array([4.0, 9.0])
    stacked = np.vstack([columns, np.diag(np.sqrt(weight))])
    right = np.concatenate([-rows, np.sqrt(weight) * centre])
    expected = np.linalg.lstsq(stacked, right, rcond=None)[0]
    np.testing.assert_allclose(regress(rows, columns, centre, weight), expected, rtol=1e-9)
