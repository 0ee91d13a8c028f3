# SPDX-License-Identifier: MIT
"""run() is step() in a loop to the last bit, takes any real array, and lets other threads work."""

import itertools
import threading
from collections.abc import Callable

import model16
import numpy as np
import policies
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid

Status = ehsid.Status


@pytest.mark.slow
@given(
    name=st.sampled_from(policies.NAMES),
    dtype=st.sampled_from(["float32", "float64"]),
    orders=st.tuples(st.integers(1, 6), st.integers(1, 6), st.integers(0, 20), st.booleans()),
    seed=st.integers(0, 1000),
)
def test_run_is_step_by_step_to_the_last_bit(
    name: str, dtype: str, orders: tuple[int, int, int, bool], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    u, y = model16.signals(seed, 150)
    u[rng.integers(150)] = np.nan
    y[rng.integers(150)] = 1e6
    u[100:] = 0.0
    na, nb, nk, offset = orders
    whole, single = (
        ehsid.ArxEstimator(
            na, nb, nk, offset=offset, forgetting=policies.PAIRS[name].compiled, dtype=dtype
        )
        for _ in range(2)
    )
    path = whole.run(u, y)
    for k in range(150):
        status = single.step(u[k], y[k])
        assert isinstance(status, Status)
        assert path.status[k] == status
        assert path.theta[k].tobytes() == single.theta_hat.astype(dtype).tobytes()
        deviation = single.standard_deviation.astype(dtype)
        assert path.standard_deviation[k].tobytes() == deviation.tobytes()
        assert path.forgetting_factor[k] == single.forgetting_factor
        assert path.residual_variance[k] == single.residual_variance
        assert path.converged[k] == single.converged
        if status in (Status.ok, Status.no_information, Status.reset):
            # A reset clears the innovation with the rest of the statistics.
            assert path.innovation[k] == single.innovation
        else:
            assert np.isnan(path.innovation[k])
    assert whole.save() == single.save()


@given(
    name=st.sampled_from(policies.NAMES),
    dtype=st.sampled_from(["float32", "float64"]),
    n=st.integers(1, 13),
    cuts=st.lists(st.integers(0, 100), max_size=3),
)
def test_a_record_in_pieces_is_the_same_record(
    name: str, dtype: str, n: int, cuts: list[int]
) -> None:
    rng = np.random.default_rng(n)
    phi, y = rng.normal(size=(100, n)), rng.normal(size=100)
    whole, pieces = (
        ehsid.Rls(n, forgetting=policies.PAIRS[name].compiled, dtype=dtype) for _ in range(2)
    )
    path = whole.run(phi, y)
    edges = [0, *sorted(cuts), 100]
    for start, stop in itertools.pairwise(edges):
        part = pieces.run(phi[start:stop], y[start:stop])
        assert part.theta.shape == (stop - start, n)
        assert part.theta.tobytes() == path.theta[start:stop].tobytes()
    assert whole.save() == pieces.save()


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("given_as", ["float32", "float64", "int8", "int64", "uint16", "bool"])
def test_arrays_of_any_real_type_give_the_same_run(given_as: str, dtype: str) -> None:
    rng = np.random.default_rng(1)
    u, y = rng.integers(0, 2, size=(2, 100)).astype(given_as)
    path = ehsid.ArxEstimator(2, 2, 1, dtype=dtype).run(u, y)
    plain = ehsid.ArxEstimator(2, 2, 1, dtype=dtype).run(u.astype(dtype), y.astype(dtype))
    assert policies.same_bits(path, plain)
    assert path.theta.dtype == path.innovation.dtype == np.dtype(dtype)
    assert path.status.dtype == np.uint8
    assert path.converged.dtype == np.bool_


def test_layout_of_the_arrays_does_not_matter() -> None:
    u, y = model16.signals(2, 200)
    phi, right = model16.regressors(u, y)
    plain = ehsid.Rls(6).run(phi, right)
    both = np.column_stack((phi, right))  # rows with a stride, a column with one
    assert policies.same_bits(plain, ehsid.Rls(6).run(both[:, :6], both[:, 6]))
    assert policies.same_bits(plain, ehsid.Rls(6).run(np.asfortranarray(phi), right))
    assert policies.same_bits(plain, ehsid.Rls(6).run(phi.tolist(), right.tolist()))
    frozen = phi.copy()
    frozen.flags.writeable = False
    assert policies.same_bits(plain, ehsid.Rls(6).run(frozen, right))


def test_an_empty_record_changes_nothing() -> None:
    estimator = ehsid.ArxEstimator(3, 3, 1)
    before = estimator.save()
    path = estimator.run([], [])
    assert path.theta.shape == path.standard_deviation.shape == (0, 6)
    assert path.innovation.shape == path.status.shape == (0,)
    assert estimator.save() == before


def test_results_belong_to_the_caller() -> None:
    u, y = model16.signals(3, 100)
    estimator = ehsid.ArxEstimator(3, 3, 1)
    path = estimator.run(u, y)
    theta, kept = estimator.theta_hat, path.theta.copy()
    before = estimator.save()
    theta[:] = np.nan
    estimator.P[:] = np.nan
    path.theta[:] = 0.0
    assert estimator.save() == before
    np.testing.assert_array_equal(estimator.theta_hat, kept[-1])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["estimator", "recursion"])
def test_other_threads_work_while_a_run_goes_on(kind: str) -> None:
    """A thread writes a growing count to the first and the last sample while a run reads them.

    theta is zero and stays so, hence the innovation is the output as the run saw it. Were the GIL
    held, the two could differ by one at most; one run that saw more is proof.
    """
    first, n = 5, 500_000
    u, y = np.zeros(n), np.zeros(n)
    stop = threading.Event()

    def count() -> None:
        turn = 0
        while not stop.is_set():
            turn += 1
            y[first] = turn
            y[-1] = turn

    def seen() -> float:
        if kind == "estimator":
            estimator = ehsid.ArxEstimator(1, 1, 1, input_limit=1e30, dtype="float64")
            innovation = estimator.run(u, y).innovation
        else:
            innovation = ehsid.Rls(1).run(u[:, None], y).innovation
        return float(innovation[-1] - innovation[first])

    counter = threading.Thread(target=count)
    counter.start()
    try:
        # A busy machine may leave the counter no turn during one run, not during all.
        assert any(seen() > 1.0 for _ in range(50))
    finally:
        stop.set()
        counter.join()


def in_use(kind: str) -> list[Callable[[], object]]:
    """Calls that use one object, its run first."""
    samples = np.random.default_rng(1).normal(size=(200_000, 2))
    u, y = samples.T.copy()
    if kind == "recursion":
        rls = ehsid.Rls(2)
        return [
            lambda: rls.run(samples, y),
            rls.reset,
            rls.reset_all,
            rls.save,
            lambda: rls.theta_hat,
            lambda: rls.update([1.0, 2.0], 3.0),
            lambda: rls.start_from_covariance([0.0, 0.0], np.eye(2)),
        ]
    if kind == "plant":
        typical = [one.typical for one in ehsid.plant_parameters()]
        plant = ehsid.Plant("linear", typical, dt_s=1e-3)
        return [lambda: plant.run(u), plant.read, lambda: plant.advance(0.0)]
    servo = ehsid.ArxEstimator(2, 2, 1)
    if kind == "bank":
        bank = ehsid.EstimatorBank([servo])
        return [lambda: bank.run(u, y), lambda: bank[0], bank.load, lambda: len(bank)]
    return [
        lambda: servo.run(u, y),
        lambda: servo.step(0.0, 0.0),
        lambda: servo.restore(b""),
        lambda: servo.covariance,
        lambda: setattr(servo, "enabled", False),
        lambda: ehsid.EstimatorBank([servo]),
        lambda: servo.seed([0.0] * 4, np.eye(4), [1.0] * 4),
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    [
        "estimator",
        "plant",
        *(pytest.param(kind, marks=pytest.mark.thorough) for kind in ("recursion", "bank")),
    ],
)
def test_an_object_is_refused_while_it_runs_in_another_thread(kind: str) -> None:
    """Before, four runs at once ended the process by a segmentation fault."""
    run, *uses = in_use(kind)

    def refused(use: Callable[[], object]) -> bool:
        errors: list[str] = []

        def tried(call: Callable[[], object]) -> None:
            try:
                call()
            except (RuntimeError, ValueError) as error:  # b"" is no snapshot, where nothing runs
                errors.append(str(error))

        running = threading.Thread(target=tried, args=(run,))
        running.start()
        while running.is_alive():
            tried(use)
        running.join()
        return any("another thread is inside run() of this object" in one for one in errors)

    for use in (run, *uses):
        # A busy machine may leave the second thread no turn during one run, not during all.
        assert any(refused(use) for _ in range(50))
    run()
