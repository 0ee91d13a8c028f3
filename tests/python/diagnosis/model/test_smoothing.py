# SPDX-License-Identifier: MIT
"""The smoother of unknown inputs against dense normal distributions and a Kalman smoother."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from ehsid.harness.diagnosis.model.smoothing import Part, ornstein_uhlenbeck, posterior, smooth


def made_part(rng: np.random.Generator, windows: int, rows: int, nodes: int, shared: int) -> Part:
    return Part(
        rng.standard_normal((windows, rows)),
        rng.standard_normal((windows, rows, nodes)),
        rng.standard_normal((windows, rows, shared)),
        rng.standard_normal((windows, nodes, shared)),
        ornstein_uhlenbeck(nodes, 0.02, 5.0),
    )


@settings(max_examples=20)
@given(
    seed=st.integers(0, 1000),
    windows=st.integers(1, 4),
    nodes=st.integers(1, 5),
    shared=st.integers(1, 3),
    size=st.floats(0.01, 10.0),
)
def test_it_is_the_dense_posterior(
    seed: int, windows: int, nodes: int, shared: int, size: float
) -> None:
    rng = np.random.default_rng(seed)
    rows = 6
    parts = [
        made_part(rng, windows, rows, nodes, shared),
        made_part(rng, 2, rows, nodes + 1, shared),
    ]
    variance = rng.uniform(0.1, 2.0, rows)
    information = rng.uniform(0.5, 4.0, shared)
    found = posterior(parts, variance, size, information)
    # All unknowns in one vector: the inputs of each window, then the shared parameters.
    blocks = [(part, w) for part in parts for w in range(part.errors.shape[0])]
    widths = [part.correlation.shape[0] for part, _ in blocks]
    total = sum(widths) + shared
    prior, design, known = np.zeros((total, total)), [], []
    first = 0
    for (part, w), width in zip(blocks, widths, strict=True):
        own = slice(first, first + width)
        prior[own, own] = size**2 * part.correlation
        row = np.zeros((rows, total))
        row[:, own], row[:, -shared:] = part.responses[w], part.slopes[w]
        design.append(row)
        whole = np.zeros((width, total))
        whole[:, own], whole[:, -shared:] = np.eye(width), part.known[w]
        known.append(whole)
        first += width
    prior[-shared:, -shared:] = np.diag(1.0 / information)
    g, h = np.vstack(design), np.vstack(known)
    errors = np.concatenate([part.errors[w] for part, w in blocks])
    noise = np.diag(np.tile(variance, len(blocks)))
    of_errors = g @ prior @ g.T + noise
    gain = prior @ g.T @ np.linalg.inv(of_errors)
    mean, covariance = -gain @ errors, prior - gain @ g @ prior
    np.testing.assert_allclose(
        np.concatenate([m.ravel() for m in found.means]), h @ mean, atol=1e-6
    )
    np.testing.assert_allclose(
        np.concatenate([d.ravel() for d in found.deviations]) ** 2,
        np.diag(h @ covariance @ h.T),
        rtol=1e-5,
    )
    assert found.evidence == pytest.approx(
        multivariate_normal(np.zeros(errors.size), of_errors).logpdf(errors), abs=1e-5
    )
    np.testing.assert_allclose(
        np.concatenate([e.ravel() for e in found.rest]), errors + g @ mean, atol=1e-5
    )
    np.testing.assert_allclose(
        np.concatenate([e.ravel() for e in found.spread]),
        np.diag(g @ covariance @ g.T),
        rtol=1e-5,
    )


@pytest.mark.parametrize("strong", [1e7, 1e10])
def test_rounding_keeps_a_strong_input_definite(strong: float) -> None:
    """Flows of 1e-8 m^3/s move the pressures of fast records: responses of 1e10 errors a unit.

    What the parameters do is nearly what the input does. The posterior of the parameters, and the
    evidence less the logarithm of the units, are those of an input that is a thousand times weaker.
    """
    rng = np.random.default_rng(7)
    windows, rows, nodes, shared = 40, 60, 12, 3
    responses = rng.standard_normal((windows, rows, nodes))
    mixed = rng.standard_normal((windows, nodes, shared))
    own = rng.standard_normal((windows, rows, shared))
    errors = rng.standard_normal((windows, rows))
    found = [
        posterior(
            [
                Part(
                    errors,
                    size * responses,
                    size * (responses @ mixed) + own,
                    np.zeros((windows, nodes, shared)),
                    ornstein_uhlenbeck(nodes, 0.02, 1.0),
                )
            ],
            np.ones(rows),
            1.0,
            np.ones(shared),
        )
        for size in (1e4, strong)
    ]
    weak, same = found
    np.testing.assert_allclose(same.changes, weak.changes, rtol=2e-3)
    # The noise of the weak input adds some 1e-4 to its deviations.
    np.testing.assert_allclose(same.deviations[0], weak.deviations[0], rtol=1e-3)
    units = windows * nodes * np.log(strong / 1e4)
    assert same.evidence == pytest.approx(weak.evidence - units, abs=0.1)


def test_it_is_a_kalman_smoother_where_the_input_is_measured_at_once() -> None:
    """An Ornstein-Uhlenbeck process in noise; the equations of Rauch, Tung and Striebel."""
    rng = np.random.default_rng(3)
    count, spacing_s, corner_hz, size, noise = 30, 0.02, 5.0, 2.0, 0.5
    step = np.exp(-2.0 * np.pi * corner_hz * spacing_s)
    measured = rng.standard_normal(count)
    mean, variance = 0.0, size**2
    filtered, predicted = [], []
    for k in range(count):
        if k > 0:
            mean, variance = step * mean, step**2 * variance + size**2 * (1.0 - step**2)
        predicted.append((mean, variance))
        gain = variance / (variance + noise)
        mean, variance = mean + gain * (measured[k] - mean), (1.0 - gain) * variance
        filtered.append((mean, variance))
    smoothed = [filtered[-1]]
    for k in range(count - 2, -1, -1):
        m, v = filtered[k]
        back = v * step / predicted[k + 1][1]
        mean = m + back * (smoothed[0][0] - predicted[k + 1][0])
        variance = v + back**2 * (smoothed[0][1] - predicted[k + 1][1])
        smoothed.insert(0, (mean, variance))
    part = Part(
        -measured[np.newaxis],
        np.eye(count)[np.newaxis],
        np.zeros((1, count, 1)),
        np.zeros((1, count, 1)),
        ornstein_uhlenbeck(count, spacing_s, corner_hz),
    )
    found = posterior([part], np.full(count, noise), size, np.ones(1))
    np.testing.assert_allclose(found.means[0][0], [m for m, _ in smoothed], atol=1e-4)
    np.testing.assert_allclose(found.deviations[0][0] ** 2, [v for _, v in smoothed], rtol=1e-3)


def test_a_known_input_comes_back_inside_its_band() -> None:
    rng = np.random.default_rng(11)
    windows, rows, nodes, size = 60, 80, 12, 3.0
    part = made_part(rng, windows, rows, nodes, 2)
    root = np.linalg.cholesky(part.correlation)
    true = size * (rng.standard_normal((windows, nodes)) @ root.T)
    shared = np.array([0.3, -0.2])
    noise = np.repeat([2.0, 30.0], rows // 2)
    errors = -np.einsum("wrn,wn->wr", part.responses, true) - part.slopes @ shared
    errors = errors + np.sqrt(noise) * rng.standard_normal(errors.shape)
    part = Part(errors, part.responses, part.slopes, 0.0 * part.known, part.correlation)
    # It is not told the size, nor how large the errors are.
    found = smooth([part], np.ones(rows), np.repeat([0, 1], rows // 2), 0.1, np.ones(2))
    assert found.size == pytest.approx(size, rel=0.1)
    np.testing.assert_allclose(found.changes, shared, atol=0.2)
    inside = np.abs(found.means[0] - true) < 1.645 * found.deviations[0]
    assert 0.86 < float(np.mean(inside)) < 0.94


def test_where_nothing_acts_the_size_vanishes() -> None:
    rng = np.random.default_rng(5)
    part = made_part(rng, 40, 60, 8, 1)
    found = smooth([part], np.ones(60), np.zeros(60, dtype=np.int64), 1.0, np.ones(1))
    assert found.size < 0.1
