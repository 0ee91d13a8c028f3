# SPDX-License-Identifier: MIT
"""A bank: every estimator in it is the ArxEstimator, bit for bit."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid

FIELDS = (
    *("theta", "standard_deviation", "innovation", "forgetting_factor"),
    *("residual_variance", "status", "converged"),
)
POLICIES: list[Callable[[], ehsid.Forgetting]] = [
    *(ehsid.Constant, ehsid.Exponential, ehsid.ErrorDriven, ehsid.FRatio),
]


def instructions() -> list[str]:
    """The sets of instructions that this machine has."""
    found = []
    for name in ("baseline", "avx2", "avx512"):
        try:
            ehsid.EstimatorBank([ehsid.ArxEstimator(1, 1, 1)], instructions=name)
        except ValueError:
            continue
        found.append(name)
    return found


def record(samples: int, count: int, seed: int) -> tuple[npt.NDArray[np.float64], ...]:
    """Machines that are excited, held, and excited as other plants; some samples are bad."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((samples, count))
    u[samples // 3 : samples // 2] = rng.choice([0.0, 0.4], count)
    noise = 10.0 ** rng.uniform(-4, -1, count)
    y = np.zeros((samples, count))
    for k in range(2, samples):
        gain = 0.2 if k < 0.7 * samples else 0.8
        y[k] = 1.5 * y[k - 1] - 0.6 * y[k - 2] + gain * u[k - 1]
        y[k] += noise * rng.standard_normal(count)
    y[int(0.65 * samples)] += 20.0 * noise  # a glitch: some begin anew once it is over
    for bad in (np.nan, np.inf, -1e30, 2e4):
        (u if rng.random() < 0.5 else y)[rng.integers(samples), rng.integers(count)] = bad
    return u, y


def assert_same(
    bank: ehsid.EstimatorBank,
    alone: list[ehsid.ArxEstimator],
    u: npt.NDArray[np.float64],
    y: npt.NDArray[np.float64],
) -> None:
    path = bank.run(u, y)
    for i, one in enumerate(alone):
        own = one.run(u[:, i], y[:, i])
        for name in FIELDS:
            expected = np.asarray(getattr(own, name))
            found = np.ascontiguousarray(np.asarray(getattr(path, name))[:, i])
            assert found.tobytes() == expected.tobytes(), (name, i)
        assert bank[i].save() == one.save(), i


# In float32 the third-order model has a kernel of its own.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("dtype", "orders", "offset"),
    [("float32", (3, 2, 1), True), ("float32", (3, 3, 1), False), ("float64", (3, 2, 1), True)],
)
@pytest.mark.parametrize("policy", POLICIES)
def test_every_estimator_is_the_one_alone(
    policy: Callable[[], ehsid.Forgetting], dtype: str, orders: tuple[int, int, int], offset: bool
) -> None:
    count = 19
    u, y = record(700, count, 1)

    def make() -> list[ehsid.ArxEstimator]:
        return [
            ehsid.ArxEstimator(
                *orders,
                offset=offset,
                forgetting=policy(),
                dtype=dtype,
                scaling=ehsid.Scaling(command_scale=1.0 + i, position_offset=0.1 * i),
                reset=None if i % 3 == 0 else ehsid.RmseResetOptions(cool_down=i),
            )
            for i in range(count)
        ]

    for name in instructions():
        assert_same(ehsid.EstimatorBank(make(), instructions=name), make(), u, y)


@given(
    seed=st.integers(0, 2**31),
    orders=st.tuples(st.integers(1, 6), st.integers(1, 6), st.integers(0, 20)),
    count=st.integers(1, 40),
    memory=st.floats(2.0, 1e4),
)
def test_any_orders_and_settings(
    seed: int, orders: tuple[int, int, int], count: int, memory: float
) -> None:
    u, y = record(120, count, seed)

    def make() -> list[ehsid.ArxEstimator]:
        return [
            ehsid.ArxEstimator(*orders, forgetting=ehsid.Constant(1 - 1 / (memory + i)))
            for i in range(count)
        ]

    assert_same(ehsid.EstimatorBank(make()), make(), u, y)


def test_one_record_serves_all_and_threads_change_nothing() -> None:
    u, y = record(300, 1, 5)
    factors = np.linspace(0.9, 1.0, 200)

    def make() -> list[ehsid.ArxEstimator]:
        return [ehsid.ArxEstimator(2, 2, 1, forgetting=ehsid.Constant(f)) for f in factors]

    shared = ehsid.EstimatorBank(make()).run(u[:, 0], y[:, 0], every=10, threads=3)
    wide = ehsid.EstimatorBank(make()).run(np.repeat(u, 200, 1), np.repeat(y, 200, 1))
    assert shared.theta.shape == (30, 200, 4)
    assert shared.theta.tobytes() == np.ascontiguousarray(wide.theta[9::10]).tobytes()
    assert shared.status.tobytes() == np.ascontiguousarray(wide.status[9::10]).tobytes()


def test_a_run_without_rows_goes_on_where_it_was() -> None:
    u, y = record(400, 3, 6)
    bank = ehsid.EstimatorBank([ehsid.ArxEstimator(2, 2, 1) for _ in range(3)])
    alone = [ehsid.ArxEstimator(2, 2, 1) for _ in range(3)]
    assert bank.run(u[:100], y[:100], every=0).theta.shape == (0, 3, 4)
    for i, one in enumerate(alone):
        one.run(u[:100, i], y[:100, i])
    assert_same(bank, alone, u[100:], y[100:])


def test_changes_of_an_estimator_reach_the_bank_by_load() -> None:
    u, y = record(200, 2, 7)
    bank = ehsid.EstimatorBank([ehsid.ArxEstimator(2, 2, 1) for _ in range(2)])
    bank.run(u, y)
    before = [bank[i].save() for i in range(2)]
    bank[0].reset()
    changed = bank[1].save()
    assert bank[0].save() == before[0]  # asked for anew, it is what the bank has
    bank[0].reset()
    bank.load()
    assert bank[0].save() != before[0]
    assert bank[1].save() == changed


def test_what_it_refuses() -> None:
    one = ehsid.ArxEstimator(2, 2, 1)
    with pytest.raises(ValueError, match="at least one"):
        ehsid.EstimatorBank([])
    with pytest.raises(ValueError, match="same object twice"):
        ehsid.EstimatorBank([one, one])
    with pytest.raises(TypeError, match="ArxEstimator"):
        ehsid.EstimatorBank([one, 3])  # type: ignore[list-item]
    with pytest.raises(TypeError, match=r"estimators\[1\] is None"):
        ehsid.EstimatorBank([one, None])  # type: ignore[list-item]
    for other in (
        ehsid.ArxEstimator(2, 2, 2),
        ehsid.ArxEstimator(2, 2, 1, dtype="float64"),
        ehsid.ArxEstimator(2, 2, 1, forgetting=ehsid.Constant()),
    ):
        with pytest.raises(ValueError, match=r"estimators\[1\] is not like"):
            ehsid.EstimatorBank([one, other])
    riv = ehsid.ArxEstimator(2, 2, 1, method="riv", forgetting=ehsid.Constant())
    with pytest.raises(ValueError, match="method='rls' only"):
        ehsid.EstimatorBank([riv])
    with pytest.raises(ValueError, match="expected one of 'baseline'"):
        ehsid.EstimatorBank([one], instructions="mmx")
    bank = ehsid.EstimatorBank([one])
    assert len(bank) == 1
    with pytest.raises(IndexError, match="bank of 1"):
        bank[1]
    with pytest.raises(ValueError, match=r"u has shape \(4, 2\); expected \(samples, 1\)"):
        bank.run(np.zeros((4, 2)), np.zeros(4))
    with pytest.raises(ValueError, match=r"y has shape \(3,\); expected \(4, 1\)"):
        bank.run(np.zeros(4), np.zeros(3))
    with pytest.raises(ValueError, match="every must be in"):
        bank.run(np.zeros(4), np.zeros(4), every=-1)
