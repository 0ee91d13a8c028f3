# SPDX-License-Identifier: MIT
"""Instrumental variables against a numpy reference, and their guards."""

import instrumental_reference as reference
import numpy as np
import numpy.typing as npt
import policies
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

import ehsid
from ehsid.lab.studies.noises import plain_deviation

FloatArray = npt.NDArray[np.float64]
# A servo that is not near an integrator and well damped: the reference needs no guard.
A, B = np.array([1.0, -1.2, 0.55, -0.1]), np.array([0.0, 0.4, 0.3, 0.2])
TRUE = np.concatenate((A[1:], B[1:]))


def record(
    seed: int, n: int, noise: float = 0.05, integrator: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Command, and position with noise of the sensor."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], size=n)
    x = lfilter(B, np.convolve(A, [1.0, -1.0]) if integrator else A, u)
    return u, np.asarray(x + noise * rng.normal(size=n))


def estimator(dtype: str = "float64", method: str = "riv", **other: object) -> ehsid.ArxEstimator:
    settings: dict[str, object] = {
        "forgetting": ehsid.Exponential(lambda0=0.995, lambda_initial=0.98),
        "reset": None,
        "method": method,
        "dtype": dtype,
        **other,
    }
    return ehsid.ArxEstimator(3, 3, 1, **settings)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("integrator", [False, True])
def test_double_agrees_with_full_matrices(integrator: bool) -> None:
    u, y = record(1, 3000, integrator=integrator)
    compiled = estimator(rls=policies.UNGUARDED, integrator=integrator)
    path = compiled.run(u, y)
    written = reference.instrumental_variables(u, y, integrator=integrator)
    # Both start with the first complete regressor, and no guard of the compiled one leaves a sample
    # out.
    assert np.count_nonzero(path.status == ehsid.Status.ok) == u.size - 3 - integrator
    np.testing.assert_allclose(compiled.theta_hat, written.theta, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(plain_deviation(compiled), written.deviation(), rtol=1e-9)


SERVO, DT_S = ehsid.ContinuousServo(gain=0.379, omega_n=387.0, xi=0.195), 1e-3


def servo_record(seed: int, n: int, null: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Steps of 150 ms, and the position of a servo far from zero with 5 um of noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-5.0, 5.0, n // 150 + 1), 150)[:n]
    theta = ehsid.discretise(SERVO, DT_S)
    x = lfilter(np.concatenate(([0.0], theta[3:])), np.concatenate(([1.0], theta[:3])), u - null)
    return u, np.asarray(0.5 + x + 5e-6 * rng.normal(size=n))


def known(dtype: str = "float32") -> ehsid.ArxEstimator:
    scaling = ehsid.Scaling(command_scale=5.0, position_scale=0.1)
    return ehsid.ArxEstimator(
        2, 3, 1, offset=True, scaling=scaling, method="riv", integrator=True, dtype=dtype,
        forgetting=ehsid.Exponential(0.995, 0.98),
    )  # fmt: skip


@pytest.mark.parametrize("null", [0.0, 0.3])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_servo_whose_integrator_is_known(dtype: str, null: float) -> None:
    compiled = known(dtype)
    status = compiled.run(*servo_record(6, 8000, null)).status
    # Where the integrator is estimated, all but 263 of these samples were left out for ever.
    assert np.count_nonzero(status == ehsid.Status.ok) > 7000
    servo = ehsid.identify_servo(compiled.theta_hat[:5], compiled.covariance[:5, :5], DT_S)
    found = np.array([servo.gain, servo.omega_n, servo.xi])
    np.testing.assert_allclose(found, [SERVO.gain, SERVO.omega_n, SERVO.xi], rtol=0.02)
    # Rounding of the product with 1 - q^-1, over Q(1) = 0.1.
    assert servo.integrator_distance < 1e-13


def test_a_long_record_stays_converged() -> None:
    compiled = known()
    for first in range(0, 60_000, 6000):
        compiled.run(*(one[first : first + 6000] for one in LONG))
        # The filters colour white noise by 0.03, which 10,000 samples show.
        assert compiled.converged


LONG = servo_record(8, 60_000)


def test_noise_that_grows_for_a_while_is_no_change() -> None:
    u, y = servo_record(9, 6000)
    y[3000:3030] += 20e-6 * np.random.default_rng(9).normal(size=30)
    compiled = known()
    path = compiled.run(u, y)
    assert compiled.resets == 0
    # Errors that are ten times the deviation may be refused as a glitch, and the filters fill anew.
    assert np.count_nonzero(path.status == ehsid.Status.ok) > 5000
    servo = ehsid.identify_servo(compiled.theta_hat[:5], np.zeros((5, 5)), DT_S)
    assert abs(servo.gain / SERVO.gain - 1.0) < 0.001


def test_float32_is_close_to_double() -> None:
    u, y = record(2, 5000)
    single, double = estimator("float32"), estimator("float64")
    single.run(u, y)
    double.run(u, y)
    # Rounding of 6e-8 times a condition number of P below 1e4, against deviations of 1e-3.
    np.testing.assert_allclose(single.theta_hat, double.theta_hat, rtol=0.0, atol=6e-4)
    np.testing.assert_allclose(single.standard_deviation, double.standard_deviation, rtol=0.01)


def test_right_where_least_squares_is_biased() -> None:
    u, y = record(3, 6000)
    compiled, plain = estimator(), estimator(method="rls")
    compiled.run(u, y)
    plain.run(u, y)
    # Of six normal errors the largest is beyond 4 deviations once in 2600 records.
    assert np.max(np.abs(compiled.theta_hat - TRUE) / compiled.standard_deviation) < 4.0
    assert np.max(np.abs(plain.theta_hat - TRUE) / plain_deviation(plain)) > 10.0


@pytest.mark.slow
@pytest.mark.parametrize("forgetting", [ehsid.Exponential(lambda0=0.995), ehsid.Constant(0.998)])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize(
    "hold",
    # Four hundred times the memory, and two thousand.
    [200_000, pytest.param(1_000_000, marks=pytest.mark.thorough)],
)
def test_a_held_command_moves_nothing(dtype: str, hold: int, forgetting: ehsid.Forgetting) -> None:
    rng = np.random.default_rng(5)
    n = 4000
    u = np.concatenate((rng.choice([-1.0, 1.0], n), np.zeros(hold), rng.choice([-1.0, 1.0], n)))
    y = lfilter(B, A, u) + 0.02 * rng.normal(size=u.size)
    compiled = estimator(dtype, forgetting=forgetting)
    compiled.run(u[:n], y[:n])
    before, deviation = np.array(compiled.theta_hat), np.array(compiled.standard_deviation)
    for start in range(n, n + hold, 100_000):
        held = compiled.run(u[start : start + 100_000], y[start : start + 100_000])
        assert np.isfinite(held.theta).all()
    assert (held.status == ehsid.Status.no_information).all()
    # The gate, or where a memory of 500 samples leaves larger deviations, one of those: the way to
    # the hold still teaches.
    assert (np.abs(compiled.theta_hat - before) < np.maximum(1e-3, deviation)).all()
    compiled.run(u[-n:], y[-n:])
    assert np.max(np.abs(compiled.theta_hat - TRUE) / compiled.standard_deviation) < 4.0


def test_a_snapshot_belongs_to_its_method() -> None:
    with pytest.raises(ValueError, match="another"):
        estimator(method="rls").restore(estimator().save())


@given(
    dtype=st.sampled_from(["float32", "float64"]),
    orders=st.tuples(st.integers(1, 6), st.integers(1, 6), st.integers(0, 4), st.booleans()),
    seed=st.integers(0, 2**16),
    size=st.floats(-3.0, 3.5),
)
def test_every_order_and_any_record_stay_finite(
    dtype: str, orders: tuple[int, int, int, bool], seed: int, size: float
) -> None:
    na, nb, nk, offset = orders
    compiled = ehsid.ArxEstimator(
        na,
        nb,
        nk,
        offset=offset,
        forgetting=ehsid.Constant(0.98),
        method="riv",
        dtype=dtype,
        gradient=ehsid.GradientOptions(settling=20),
    )
    rng = np.random.default_rng(seed)
    u, y = 10.0**size * rng.normal(size=(2, 300))
    u[200:] = u[200]
    path = compiled.run(u, y)
    assert np.isfinite(path.theta).all()
    assert np.isfinite(path.standard_deviation).all()
    assert (path.standard_deviation >= 0.0).all()


def test_refused_arguments() -> None:
    with pytest.raises(ValueError, match="method is 'oe'; expected 'rls' or 'riv'"):
        estimator(method="oe")
    with pytest.raises(ValueError, match="Constant and Exponential only"):
        estimator(forgetting=ehsid.FRatio())
    with pytest.raises(ValueError, match="settling in 1"):
        ehsid.GradientOptions(settling=0)
    with pytest.raises(ValueError, match="start_pole < 1"):
        ehsid.GradientOptions(start_pole=1.0)
