# SPDX-License-Identifier: MIT
"""The likelihood of the errors of an output: its gradient, and what it does not depend on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_spectra import spectrum_of

from ehsid.harness.diagnosis.model.spectrum import BANDS, OutputLikelihood

# Two records whose windows have the same length, and a third with shorter ones.
SHAPES = [(3, 40), (2, 40), (2, 12)]
SPECTRUM = spectrum_of(*SHAPES)


def likelihood(seed: int = 0, *, white: bool = False) -> OutputLikelihood:
    """Any counts up to the number of coefficients, any powers that are tolerated."""
    rng = np.random.default_rng(seed)
    counts = SPECTRUM.sizes * rng.uniform(0.1, 1.0, BANDS)
    return OutputLikelihood(SPECTRUM, counts, rng.uniform(0.1, 2.0, BANDS), white)


def draw_errors(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.standard_normal(windows * length) for windows, length in SHAPES]


@pytest.mark.parametrize("white", [False, True])
@given(seed=st.integers(0, 500))
def test_weights_are_the_gradient_of_the_cost(white: bool, seed: int) -> None:
    subject = likelihood(seed, white=white)
    coefficients = SPECTRUM.transform(draw_errors(seed), differences=False)
    gradient = SPECTRUM.spread(subject.weights(coefficients)) * coefficients
    direction = np.random.default_rng(seed + 1).standard_normal(coefficients.size)
    step = 1e-5
    ends = [subject.cost(coefficients + sign * step * direction) for sign in (1.0, -1.0)]
    # The cost is below 300: rounding of 1e-13 over 2e-5, and the third derivative, up to 1e3, times
    # step^2 / 6, leave 1e-7.
    by_differences = (ends[0] - ends[1]) / (2.0 * step)
    assert gradient @ direction == pytest.approx(by_differences, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("white", [False, True])
@given(seed=st.integers(0, 500), data=st.data())
def test_the_order_of_the_windows_does_not_matter(
    white: bool, seed: int, data: st.DataObject
) -> None:
    errors = draw_errors(seed)
    windows = np.concatenate([rows.reshape(-1, 40) for rows in errors[:2]])
    order = data.draw(st.permutations(range(5)))
    exchanged = windows[list(order)]
    after = [exchanged[:3].ravel(), exchanged[3:].ravel(), errors[2]]
    subject = likelihood(white=white)
    costs = [subject.cost(SPECTRUM.transform(each, differences=False)) for each in (errors, after)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-12)


@given(seed=st.integers(0, 500), drift=st.floats(10.0, 1e4))
def test_a_slow_drift_hides_nothing_in_the_other_octaves(seed: int, drift: float) -> None:
    """A drift of half a period in each window is coefficient 1, which is a band of its own."""
    errors = draw_errors(seed)
    drifting = []
    for rows, (windows, length) in zip(errors, SHAPES, strict=True):
        half_period = np.cos(np.pi * (np.arange(length) + 0.5) / length)
        drifting.append(rows + drift * np.tile(half_period, windows))
    before, after = (SPECTRUM.transform(each, differences=False) for each in (errors, drifting))
    coloured, white = likelihood(), likelihood(white=True)
    others = np.arange(BANDS) != 1
    # Rounding of the drift in the other coefficients: 1e4 times 1e-15, beside errors near 1.
    np.testing.assert_allclose(
        coloured.weights(after)[others], coloured.weights(before)[others], rtol=1e-8
    )
    assert coloured.weights(after)[1] < 0.1 * coloured.weights(before)[1]
    # Where the disturbance is taken for white, it hides errors in all octaves.
    assert np.all(white.weights(after) < 0.5 * white.weights(before))


@pytest.mark.parametrize("white", [False, True])
@given(seed=st.integers(0, 500), band=st.integers(0, BANDS - 1), more=st.floats(0.0, 1e3))
def test_larger_errors_never_cost_less(white: bool, seed: int, band: int, more: float) -> None:
    subject = likelihood(seed, white=white)
    powers = np.random.default_rng(seed).uniform(0.0, 3.0, BANDS)
    larger = powers + more * (np.arange(BANDS) == band)
    # Equal where the band has no coefficients. Sums of the same terms may differ by rounding.
    assert subject.cost_of(larger) >= subject.cost_of(powers) - 1e-12


def test_the_cost_is_that_of_the_formula() -> None:
    subject = likelihood(3)
    coefficients = SPECTRUM.transform(draw_errors(3), differences=False)
    expected = 0.0
    for band, rows in enumerate(SPECTRUM.bands):
        squares = np.concatenate([coefficients[part] ** 2 for part in rows])
        power = squares.mean() if squares.size else 0.0
        expected += 0.5 * subject.counts[band] * np.log(power + subject.tolerated[band])
    assert subject.cost(coefficients) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("white", [False, True])
@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_errors_that_are_not_finite_cost_without_end(white: bool, wrong: float) -> None:
    coefficients = SPECTRUM.transform(draw_errors(4), differences=False)
    coefficients[7] = wrong
    assert likelihood(white=white).cost(coefficients) == np.inf
