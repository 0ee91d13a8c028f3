# SPDX-License-Identifier: MIT
"""Evidence with terms whose sizes are not known, on quadratics made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from ehsid.harness.diagnosis.model.separation import Quadratic, relevance

ROWS = 120


def made_quadratic(
    rng: np.random.Generator, sizes: tuple[float, ...], tolerated: float = 1e-9
) -> tuple[Quadratic, np.ndarray, np.ndarray]:
    """White noise of variance one and terms of three parameters each, in one band."""
    slopes = rng.standard_normal((ROWS, 3 * len(sizes)))
    true = np.concatenate([size * rng.standard_normal(3) for size in sizes])
    errors = rng.standard_normal(ROWS) - slopes @ true
    quadratic = Quadratic(
        np.array([errors @ errors]),
        (slopes.T @ errors)[np.newaxis],
        (slopes.T @ slopes)[np.newaxis],
        np.array([float(ROWS)]),
        np.array([float(ROWS)]),
        np.array([tolerated]),
    )
    return quadratic, errors, slopes


def test_needless_terms_get_no_size() -> None:
    quadratic, _, _ = made_quadratic(np.random.default_rng(1), (2.0, 0.0, 5.0))
    blocks = [np.arange(3), np.arange(3, 6), np.arange(6, 9)]
    found = relevance(quadratic, np.zeros(9), np.ones(9), blocks)
    assert found.factors[0] > 0.3
    assert found.factors[2] > 2.0
    assert found.factors[1] < 0.05


def test_more_terms_that_do_nothing_are_no_advantage() -> None:
    gains = []
    for seed in range(8):
        quadratic, _, _ = made_quadratic(np.random.default_rng(seed), (0.0, 0.0, 0.0))
        blocks = [np.arange(3), np.arange(3, 6), np.arange(6, 9)]
        many = relevance(quadratic, np.zeros(9), np.ones(9), blocks).evidence
        held = relevance(quadratic, np.zeros(9), np.full(9, 1e12), []).evidence
        gains.append(many - held)
    assert -1.0 < float(np.mean(gains)) < 1.0


@pytest.mark.slow
@settings(max_examples=10)
@given(seed=st.integers(0, 100), size=st.floats(0.5, 3.0))
def test_differences_are_those_of_the_exact_evidence(seed: int, size: float) -> None:
    """Of a term of known size, with the variance of the noise at its best."""
    quadratic, errors, slopes = made_quadratic(np.random.default_rng(seed), (size,))
    with_term = relevance(quadratic, np.zeros(3), np.ones(3), []).evidence
    without = relevance(quadratic, np.zeros(3), np.full(3, 1e12), []).evidence

    def exact(covariance: np.ndarray) -> float:
        variances = np.linspace(0.6, 1.6, 40)
        if covariance.max() == 0.0:
            variances = np.array([errors @ errors / ROWS])
        whole = slopes @ covariance @ slopes.T
        return max(
            float(multivariate_normal(np.zeros(ROWS), whole + v * np.eye(ROWS)).logpdf(errors))
            for v in variances
        )

    assert with_term - without == pytest.approx(exact(np.eye(3)) - exact(np.zeros((3, 3))), abs=1.0)
