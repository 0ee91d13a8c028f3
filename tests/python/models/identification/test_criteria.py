# SPDX-License-Identifier: MIT
"""Criteria against published figures, another library, and figures worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from statsmodels.tools.eval_measures import aic_sigma, bic_sigma

from ehsid.harness.models.identification import aic, criteria, fit_percent, fpe, loss, mdl
from ehsid.harness.models.identification.candidates import simulation_cell, simulation_words


@pytest.mark.parametrize(
    ("order", "published_fpe", "published_loss"),
    [
        (2, 0.0325882, 0.0323295),
        (3, 0.0230747, 0.0228011),
        (4, 0.0217047, 0.0213629),
        (5, 0.0215606, 0.0211378),
    ],
)
def test_fpe_of_the_reference_experiment(
    order: int, published_fpe: float, published_loss: float
) -> None:
    """Ghazali et al. 2011: half of 100 s at 50 ms are N = 1000 samples, d = 2 n parameters.

    The published figures are V (1 + 2 d/N), the first terms of V (1 + s) / (1 - s) with s = d/N;
    the two differ by V 2 s^2 / (1 - s).
    """
    share = 2 * order / 1000
    difference = published_loss * 2 * share**2 / (1 - share)
    ours = fpe(published_loss, 1000, 2 * order)
    # Both published figures are rounded to 5e-8.
    assert ours - difference == pytest.approx(published_fpe, abs=2 * 5e-8)


def test_figures_by_hand() -> None:
    residual = np.array([1.0, -1.0, 2.0, 0.0])
    assert loss(residual) == 6 / 4
    assert fpe(1.5, 4, 2) == pytest.approx(1.5 * 1.5 / 0.5)
    assert aic(1.5, 4, 2) == pytest.approx(math.log(1.5) + 1.0)
    assert mdl(1.5, 4, 2) == pytest.approx(1.5 * (1 + 2 * math.log(4) / 4))
    together = criteria(residual, 2)
    assert (together.n_rows, together.loss) == (4, 1.5)
    assert (together.fpe, together.aic, together.mdl) == (fpe(1.5, 4, 2), aic(1.5, 4, 2),
                                                         mdl(1.5, 4, 2))  # fmt: skip


@given(v=st.floats(1e-12, 1e12), n=st.integers(10, 10**6), d=st.integers(1, 9))
def test_aic_and_mdl_against_statsmodels(v: float, n: int, d: int) -> None:
    assert aic(v, n, d) == pytest.approx(aic_sigma(v, n, d), rel=1e-12, abs=1e-12)
    # Theirs is ln V + d ln(N)/N; ours the same to first order, V (1 + d ln(N)/N).
    penalty = bic_sigma(v, n, d) - math.log(v)
    assert mdl(v, n, d) == pytest.approx(v * (1 + penalty), rel=1e-9)


def test_limits() -> None:
    assert fpe(1.0, 5, 5) == math.inf
    assert aic(0.0, 10, 2) == -math.inf
    y = np.array([1.0, 2.0, 3.0])
    assert fit_percent(y, y) == 100.0
    assert fit_percent(y, np.full(3, 2.0)) == 0.0
    assert fit_percent(y, np.array([3.0, 2.0, 1.0])) == pytest.approx(-100.0)
    assert fit_percent(y, np.array([1.0, np.inf, np.nan])) == -math.inf
    assert fit_percent(y, np.array([1.0, 1e300, 1e308])) < -1e300
    assert math.isnan(fit_percent(np.ones(3), y))


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=30), st.floats(0.01, 100.0))
def test_fit_does_not_depend_on_units_or_zero(values: list[float], scale: float) -> None:
    y = np.array(values)
    if np.ptp(y) < 1e-3:
        return
    predicted = np.roll(y, 1)
    # The shift rounds y by eps x 1e4, against a spread of 1e-3 at least.
    moved = fit_percent(scale * (y + 100.0), scale * (predicted + 100.0))
    assert moved == pytest.approx(fit_percent(y, predicted), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("fit", "words", "cell"),
    [
        (92.612, "simulation fit 92.61 %", "92.61"),
        (-95.69, "simulation fit -95.69 %", "-95.69"),
        (-1e30, "the simulation diverges", "diverges"),
        (-math.inf, "the simulation diverges", "diverges"),
    ],
)
def test_a_simulation_that_grows_without_end_diverges(fit: float, words: str, cell: str) -> None:
    assert simulation_words(fit) == words
    assert simulation_cell(fit) == cell
