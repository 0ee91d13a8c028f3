# SPDX-License-Identifier: MIT
"""ArxEstimator: regressor, units, scaling, switching, convergence, bad samples."""

import math

import model16
import numpy as np
import numpy.typing as npt
import numpy_reference as reference
import policies
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import ehsid

FloatArray = npt.NDArray[np.float64]
Status = ehsid.Status


def full(na: int, nb: int, nk: int) -> int:
    """Samples before the first complete regressor."""
    return max(na, nk + nb - 1)


@pytest.mark.slow
@given(
    na=st.integers(1, 6),
    nb=st.integers(1, 6),
    nk=st.integers(0, 20),
    offset=st.booleans(),
    pair=policies.ANY,
    seed=st.integers(0, 2**32 - 1),
)
def test_every_structure_agrees_with_the_reference(
    na: int, nb: int, nk: int, offset: bool, pair: policies.Pair, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    samples, n = 150, na + nb + offset
    u, y = 3.0 + 5.0 * rng.normal(size=samples), 0.1 + 0.02 * rng.normal(size=samples)
    scale_u, scale_y, offset_u, offset_y = 7.0, 0.03, 2.5, 0.12
    theta0, variance0 = rng.normal(size=n), 10.0 ** rng.uniform(0.0, 2.0, size=n)
    estimator = ehsid.ArxEstimator(
        na,
        nb,
        nk,
        offset=offset,
        forgetting=pair.compiled,
        scaling=ehsid.Scaling(
            command_scale=scale_u,
            position_scale=scale_y,
            command_offset=offset_u,
            position_offset=offset_y,
        ),
        rls=policies.UNGUARDED,
        reset=None,
        theta0=theta0,
        variance0=variance0,
        dtype="float64",
    )
    path = estimator.run(u, y)

    unit = np.array([1.0] * na + [scale_y / scale_u] * nb + [scale_y] * offset)
    numpy_rls = reference.Reference(theta0 / unit, variance0, pair.written(n))
    phi, right = model16.regressors(
        (u - offset_u) / scale_u, (y - offset_y) / scale_y, na, nb, nk, offset
    )
    start = full(na, nb, nk)
    assert (path.status[:start] == Status.filling).all()
    assert np.isnan(path.innovation[:start]).all()
    # White signals of order one: condition numbers up to about 1e3 with the prior, eps a step, 130
    # steps, and 35 for the growth allowed by policies.ANY: 1e-9.
    for k in range(right.size):
        kept = numpy_rls.update(phi[k], right[k])
        row = start + k
        assert path.status[row] == (Status.ok if kept else Status.no_information)
        assert abs(path.innovation[row] / scale_y - numpy_rls.epsilon) < 1e-9
        assert abs(path.forgetting_factor[row] - numpy_rls.factor) < 1e-9
        np.testing.assert_allclose(path.theta[row] / unit, numpy_rls.theta, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(estimator.P, numpy_rls.P, rtol=0.0, atol=1e-9 * variance0.max())
    variance = numpy_rls.residual_variance
    np.testing.assert_allclose(estimator.residual_variance, variance * scale_y**2, rtol=1e-8)
    inflation = 1.0 if estimator.residuals_white else 1.0 + estimator.whiteness
    covariance = inflation * numpy_rls.parameter_variance * numpy_rls.P * np.outer(unit, unit)
    size = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    np.testing.assert_allclose(estimator.covariance / size, covariance / size, rtol=0.0, atol=1e-8)
    deviation = np.sqrt(np.diag(estimator.covariance))
    np.testing.assert_allclose(estimator.standard_deviation, deviation, rtol=1e-14)


@given(
    name=st.sampled_from(policies.NAMES),
    dtype=st.sampled_from(["float32", "float64"]),
    seed=st.integers(0, 1000),
)
@example(name="error_driven", dtype="float32", seed=17)  # its residuals are not white
def test_is_the_recursion_on_its_regressors_to_the_last_bit(
    name: str, dtype: str, seed: int
) -> None:
    u, y = (x.astype(dtype) for x in model16.signals(seed, 300))
    forgetting = policies.PAIRS[name].compiled
    estimator = ehsid.ArxEstimator(3, 3, 1, forgetting=forgetting, reset=None, dtype=dtype)
    path = estimator.run(u, y)
    rls = ehsid.Rls(6, forgetting=forgetting, dtype=dtype)
    alone = rls.run(*model16.regressors(u, y))
    assert path.theta[3:].tobytes() == alone.theta.tobytes()
    assert path.innovation[3:].tobytes() == alone.innovation.tobytes()
    assert path.status[3:].tobytes() == alone.status.tobytes()
    ours, recursion = policies.bits(estimator), policies.bits(rls)
    if not estimator.residuals_white:  # then the estimator knows that it knows less
        assert np.all(estimator.standard_deviation > rls.standard_deviation)
        del ours["standard_deviation"], recursion["standard_deviation"]
    assert ours == recursion


@given(
    name=st.sampled_from(policies.NAMES),
    dtype=st.sampled_from(["float32", "float64"]),
    power_u=st.integers(-20, 20),
    power_y=st.integers(-20, 20),
    seed=st.integers(0, 1000),
)
def test_units_by_powers_of_two_change_no_decision_and_no_digit(
    name: str, dtype: str, power_u: int, power_y: int, seed: int
) -> None:
    """Volts or millivolts, metres or inches: a power of two is exact, so every bit must agree."""
    rng = np.random.default_rng(seed)
    u = np.concatenate((rng.choice([-1.0, 1.0], 300), np.zeros(300), rng.normal(size=100)))
    b = np.where(np.arange(u.size) < 650, 1.0, 2.0)  # the plant changes as well
    y = model16.output(b * u, 1e-2 * rng.normal(size=u.size))
    in_u, in_y = 2.0**power_u, 2.0**power_y
    unit = np.array([1.0] * 3 + [in_y / in_u] * 3 + [in_y])

    def run(factor_u: float, factor_y: float, theta0: FloatArray) -> ehsid.Trajectory:
        scaling = ehsid.Scaling(
            command_scale=0.75 * factor_u,
            position_scale=2.5 * factor_y,
            command_offset=0.25 * factor_u,
            position_offset=-1.5 * factor_y,
        )
        estimator = ehsid.ArxEstimator(
            3,
            3,
            1,
            offset=True,
            forgetting=policies.PAIRS[name].compiled,
            scaling=scaling,
            theta0=theta0,
            dtype=dtype,
        )
        return estimator.run(factor_u * u.astype(dtype), factor_y * y.astype(dtype))

    theta0 = np.linspace(-1.0, 0.5, 7)
    plain, scaled = run(1.0, 1.0, theta0), run(in_u, in_y, theta0 * unit)
    np.testing.assert_array_equal(scaled.status, plain.status)
    np.testing.assert_array_equal(scaled.converged, plain.converged)
    np.testing.assert_array_equal(scaled.forgetting_factor, plain.forgetting_factor)
    np.testing.assert_array_equal(scaled.theta, plain.theta * unit.astype(dtype))
    np.testing.assert_array_equal(
        scaled.standard_deviation, plain.standard_deviation * unit.astype(dtype)
    )
    np.testing.assert_array_equal(scaled.innovation, plain.innovation * np.dtype(dtype).type(in_y))


def test_constant_term_takes_up_what_the_scaling_leaves() -> None:
    u, y = model16.signals(1, 3000, noise=1e-3)
    y += 40.0  # a constant added to y: c = 40 (1 + a1 + a2 + a3)
    estimator = ehsid.ArxEstimator(
        3, 3, 1, offset=True, forgetting=ehsid.Constant(1.0), dtype="float64"
    )
    estimator.run(u, y)
    truth = np.append(model16.THETA, 40.0 * (1.0 + model16.A.sum()))
    error = np.abs(estimator.theta_hat - truth)
    assert (error < 5.0 * estimator.standard_deviation).all()
    assert (error[3:6] < 1e-3).all()


@given(
    name=st.sampled_from(policies.NAMES),
    off=st.integers(0, 60),
    length=st.integers(1, 60),
)
def test_switching_off_and_on_is_bumpless(name: str, off: int, length: int) -> None:
    u, y = (x.astype(np.float32) for x in model16.signals(2, 200))
    forgetting = policies.PAIRS[name].compiled
    estimator = ehsid.ArxEstimator(3, 3, 1, forgetting=forgetting, reset=None)
    estimator.run(u[:off], y[:off])
    before = policies.bits(estimator)
    assert estimator.enabled
    estimator.enabled = False
    on = off + length
    path = estimator.run(u[off:on], y[off:on])
    assert (path.status == Status.disabled).all()
    assert np.isnan(path.innovation).all()
    assert policies.bits(estimator) == before
    estimator.enabled = True
    estimator.run(u[on:], y[on:])
    # The history moved on: what follows is what the recursion makes of all samples but those.
    phi, right = model16.regressors(u, y)
    k = np.arange(3, 200)
    used = (k < off) | (k >= on)
    rls = ehsid.Rls(6, forgetting=forgetting, dtype="float32")
    rls.run(phi[used], right[used])
    assert policies.bits(estimator) == policies.bits(rls)


def test_convergence_is_judged_in_sigma_squared_p() -> None:
    """The documented rule, with numpy: all deviations inside the tolerance, `hold` in a row."""
    u, y = model16.signals(3, 3000, noise=0.02)
    options = ehsid.ConvergenceOptions(tolerance=0.01, magnitude=0.5, hold=30)
    estimator = ehsid.ArxEstimator(
        3,
        3,
        1,
        forgetting=ehsid.Constant(1.0),
        reset=None,
        convergence=options,
        scaling=ehsid.Scaling(position_scale=4.0),
        dtype="float64",
    )
    path = estimator.run(u, y)
    unit = np.array([1.0] * 3 + [4.0] * 3)
    deviation, theta = path.standard_deviation / unit, path.theta / unit
    inside = (deviation <= 0.01 * np.maximum(np.abs(theta), 0.5)).all(axis=1)
    inside &= np.arange(3000) - 2 > 12  # more samples used than twice the parameters
    settled = [k >= 29 and bool(inside[k - 29 : k + 1].all()) for k in range(3000)]
    assert estimator.residuals_white
    tested = np.arange(3000) - 2 >= 12 + 300  # the test for white residuals begins there, too
    expected = np.asarray(settled) & tested
    assert 100 < np.count_nonzero(expected) < 2900
    np.testing.assert_array_equal(path.converged, expected)


def test_excitation_is_the_share_of_samples_that_tell_something() -> None:
    estimator = ehsid.ArxEstimator(2, 2, 1, forgetting=ehsid.Constant(0.95))
    rng = np.random.default_rng(4)
    path = estimator.run(rng.normal(size=500), rng.normal(size=500))
    assert (path.status[2:] == Status.ok).all()
    assert estimator.excitation == 1.0
    # Held: a memory of 20 samples later some parameter is starved, three and a half later the rest
    # begins, and nothing counts as excited from then on: (1 - 1/100)^900 = 1e-4 is left.
    path = estimator.run(np.zeros(1000), np.zeros(1000))
    assert (path.status[:2] == Status.ok).all()
    assert (path.status[100:] == Status.no_information).all()
    assert estimator.excitation < 1e-3
    # Excited anew: (1 - 1/100)^300 = 5 % are missing, and what it took to notice.
    path = estimator.run(rng.normal(size=300), rng.normal(size=300))
    assert (path.status == Status.ok).mean() > 0.95
    assert 0.85 < estimator.excitation < 1.0


@pytest.mark.parametrize("limit", [None, 5.0])
def test_implausible_samples_are_refused(limit: float | None) -> None:
    estimator = ehsid.ArxEstimator(
        1, 1, 1, input_limit=limit, scaling=ehsid.Scaling(command_scale=10.0, position_offset=1.0)
    )
    bound = 1e4 if limit is None else limit
    assert estimator.step(10.0 * bound, 1.0 + bound) == Status.filling
    assert estimator.step(10.1 * bound, 1.0) == Status.out_of_range
    assert estimator.step(0.0, 1.0 - 1.01 * bound) == Status.out_of_range


@given(
    name=st.sampled_from(policies.NAMES),
    dtype=st.sampled_from(["float32", "float64"]),
    bad_rows=st.sets(st.integers(0, 199), max_size=12),
)
@settings(max_examples=50)
def test_estimator_rests_on_a_bad_sample_and_fills_anew(
    name: str, dtype: str, bad_rows: set[int]
) -> None:
    u, y = (x.astype(dtype) for x in model16.signals(1, 200))
    forgetting = policies.PAIRS[name].compiled
    estimator = ehsid.ArxEstimator(3, 3, 1, forgetting=forgetting, dtype=dtype)
    gap = 0
    for k in range(200):
        if k in bad_rows:
            before = policies.bits(estimator)
            value = (math.nan, math.inf, -math.inf, 1e5, -3e38)[k % 5]
            sample = (value, y[k]) if k % 2 else (u[k], value)
            expected = Status.out_of_range if math.isfinite(value) else Status.invalid_input
            assert estimator.step(*sample) == expected
            assert policies.bits(estimator) == before
            gap = 0
            continue
        status = estimator.step(u[k], y[k])
        assert (status == Status.filling) == (gap < 3)
        gap += 1
