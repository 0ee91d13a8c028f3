# SPDX-License-Identifier: MIT
"""Least squares with a known integrator: against scipy, and K of a servo with a noisy sensor."""

import instrumental_reference as reference
import numpy as np
import numpy.typing as npt
import policies
import pytest
from scipy.linalg import lstsq
from scipy.signal import lfilter

import ehsid

FloatArray = npt.NDArray[np.float64]
SERVO, DT_S = ehsid.ContinuousServo(gain=0.05, omega_n=60.0, xi=0.4), 5e-3


def record(seed: int, n: int, null: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Random steps, and the position far from zero with 5 um of noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-5.0, 5.0, n // 12 + 1), 12)[:n]
    theta = ehsid.discretise(SERVO, DT_S)
    x = lfilter(np.concatenate(([0.0], theta[3:])), np.concatenate(([1.0], theta[:3])), u - null)
    return u, np.asarray(0.5 + x + 5e-6 * rng.normal(size=n))


def known(dtype: str = "float32", **other: object) -> ehsid.ArxEstimator:
    settings: dict[str, object] = {
        "scaling": ehsid.Scaling(command_scale=5.0, position_scale=0.1),
        "offset": True,
        **other,
    }
    return ehsid.ArxEstimator(2, 3, 1, integrator=True, dtype=dtype, **settings)  # type: ignore[arg-type]


@pytest.mark.parametrize("lambda0", [1.0, 0.995])
def test_double_agrees_with_batch_least_squares(lambda0: float) -> None:
    u, y = record(1, 2000)
    compiled = known(
        "float64", forgetting=ehsid.Constant(lambda0), rls=policies.UNGUARDED, reset=None,
        offset=False, scaling=ehsid.Scaling(),
    )  # fmt: skip
    compiled.run(u, y)
    phi, outputs = reference.equations(u, y, 2, 3, integrator=True)
    weights = np.sqrt(lambda0 ** np.arange(phi.shape[0])[::-1])
    # P0 = 1e6 as five equations that say zero, forgotten like the others.
    start = 1e-3 * np.sqrt(lambda0 ** phi.shape[0]) * np.eye(5)
    expected = lstsq(
        np.vstack((start, weights[:, None] * phi)),
        np.concatenate((np.zeros(5), weights * outputs)),
    )[0]
    # Rounding of 1e-16 times a condition number of the normal equations of 1e9.
    np.testing.assert_allclose(compiled.theta_hat, expected, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("null", [0.0, 0.3])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_gain_is_right_where_the_integrator_is_known(dtype: str, null: float) -> None:
    u, y = record(2, 6000, null)
    compiled = known(dtype)
    compiled.run(u, y)
    servo = ehsid.identify_servo(compiled.theta_hat[:5], compiled.covariance[:5, :5], DT_S)
    assert abs(servo.gain / SERVO.gain - 1.0) < 0.01
    # The interval knows that the residuals are not white.
    assert abs(servo.gain - SERVO.gain) < 3.0 * servo.gain_std


def test_bad_samples_leave_the_estimate_bit_for_bit() -> None:
    u, y = record(3, 800)
    compiled = known()
    compiled.run(u, y)
    before = compiled.theta_hat.tobytes(), compiled.P.tobytes()
    for bad in (float("nan"), float("inf"), 1e30):
        assert ehsid.is_error(compiled.step(bad, 0.5))
        assert ehsid.is_error(compiled.step(0.0, bad))
        assert (compiled.theta_hat.tobytes(), compiled.P.tobytes()) == before


@pytest.mark.parametrize("cut", [2, 50, 700])
def test_restored_goes_on_bit_for_bit(cut: int) -> None:
    u, y = record(4, 1500)
    whole, other = known(), known()
    whole.run(u[:cut], y[:cut])
    other.restore(whole.save())
    first, second = whole.run(u[cut:], y[cut:]), other.run(u[cut:], y[cut:])
    assert first.theta.tobytes() == second.theta.tobytes()
    assert whole.save() == other.save()
    with pytest.raises(ValueError, match="another"):
        known(method="riv", forgetting=ehsid.Exponential()).restore(whole.save())
    with pytest.raises(ValueError, match="another"):
        ehsid.ArxEstimator(2, 3, 1, offset=True).restore(whole.save())
