# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.models.identification import ArxOrders
from ehsid.lab.studies import MODEL_16, KnownPlant


def difference_equation(plant: KnownPlant, u: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Eq. (7) sample by sample, as it is written."""
    orders, theta = plant.orders, plant.theta_path(u.size)
    y = np.zeros(u.size)
    for k in range(u.size):
        y[k] = e[k]
        for i in range(orders.na):
            if k - 1 - i >= 0:
                y[k] -= theta[k, i] * y[k - 1 - i]
        for j in range(orders.nb):
            if k - orders.nk - j >= 0:
                y[k] += theta[k, orders.na + j] * u[k - orders.nk - j]
    return y


@given(
    na=st.integers(1, 4),
    nb=st.integers(1, 4),
    nk=st.integers(0, 5),
    changes=st.lists(st.integers(0, 59), max_size=3, unique=True),
    seed=st.integers(0, 2**32 - 1),
)
def test_response_is_that_of_the_difference_equation(
    na: int, nb: int, nk: int, changes: list[int], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    orders = ArxOrders(na, nb, nk)

    def parameters() -> np.ndarray:
        # |a1| + .. + |a_na| < 1: stable whatever the pieces.
        return np.concatenate([rng.uniform(-0.9, 0.9, na) / na, rng.normal(size=nb)])

    plant = KnownPlant.of(orders, parameters())
    for at in sorted(changes):
        plant = plant.changed(at, parameters())
    u, e = rng.normal(size=(2, 60))
    expected = difference_equation(plant, u, e)
    # 60 samples, a handful of products each, of a stable recursion: 1e-13 of the largest value.
    np.testing.assert_allclose(
        plant.respond(u, e), expected, rtol=0.0, atol=1e-13 * (1.0 + np.abs(expected).max())
    )


def test_theta_path_changes_at_the_sample_named() -> None:
    before, after = np.array([0.5, 1.0]), np.array([0.5, 2.0])
    path = KnownPlant.of(ArxOrders(1, 1), before).changed(3, after).theta_path(5)
    np.testing.assert_array_equal(path[:, 1], [1.0, 1.0, 1.0, 2.0, 2.0])


def test_model_16_integrates() -> None:
    # A(1) = 0.0003: a constant command moves the rod at nearly constant speed.
    assert 1.0 + sum(MODEL_16[:3]) == pytest.approx(0.0003, abs=1e-12)
    y = KnownPlant.of(ArxOrders(3, 3), MODEL_16).respond(np.ones(200), np.zeros(200))
    speed = np.diff(y)[50:100]
    # B(1) / (1 - pole sum of the rest) = 0.0994 / 0.3037 a sample, falling slowly with the pole.
    assert speed == pytest.approx(0.0994 / 0.3037, rel=0.15)
