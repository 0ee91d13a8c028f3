# SPDX-License-Identifier: MIT
"""The servo model: against scipy, exact decimals, numpy roots and Monte Carlo."""

from __future__ import annotations

from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import scipy.signal
import scipy.stats
from hypothesis import assume, given
from hypothesis import strategies as st

import ehsid

Array = npt.NDArray[np.float64]

EPS = float(np.finfo(float).eps)
DT = 0.05
NO_COVARIANCE = np.zeros((6, 6))
MODEL_16 = np.array([-2.2390, 1.7820, -0.5427, 0.3850, -0.5810, 0.2954])
# 63 mm bore, 35 mm rod, mean area 2.6e-3 m^2, 0.4 l of oil, 120 kg
RIG = {
    "k_v": 1e-4,
    "k_q": 0.6,
    "k_c": 4e-12,
    "c_p": 1e-12,
    "a_p": 2.6e-3,
    "v_t": 4e-4,
    "beta_e": 1.1e9,
    "m_t": 120.0,
}

dampings = st.floats(0.01, 3.0)
phases = st.floats(-5.9, float(np.log10(3.0))).map(lambda e: float(10.0**e))


def servo(gain: float, omega_n: float, xi: float) -> ehsid.ContinuousServo:
    return ehsid.ContinuousServo(gain=gain, omega_n=omega_n, xi=xi)


def unit_theta(x: float, xi: float) -> Array:
    """Theta for K = 1, dt = 1 and omega_n dt = x."""
    return np.asarray(ehsid.discretise(servo(1.0, x, xi), 1.0))


def exact_theta(x: float, xi: float) -> Array:
    """The same from Taylor series in 120 digits: step response Y at 1, 2, 3, B = A (1 - 1/z) Y."""
    with localcontext() as context:
        context.prec = 120
        v, y = 2 * Decimal(xi) * Decimal(x), Decimal(x) ** 2

        def series(t: int) -> tuple[Decimal, Decimal, Decimal]:
            """e, its derivative and the position y * double integral of e at t."""
            before, term = Decimal(0), Decimal(1)  # e_0, e_1 of e = sum e_k t^k
            e, slope, position = term * t, term, y * term * t**3 / 6
            for k in range(2, 400):
                before, term = term, -((k - 1) * v * term + y * before) / (k * (k - 1))
                power = Decimal(t) ** k
                e += term * power
                slope += k * term * power / t
                position += y * term * power * t * t / ((k + 1) * (k + 2))
            return e, slope, position

        e, slope, s1 = series(1)
        s2, s3 = series(2)[2], series(3)[2]
        q1 = -(2 * slope + v * e)  # minus the trace of the transition matrix
        q2 = (-v).exp()
        a = [q1 - 1, q2 - q1, -q2]
        d1, d2, d3 = s1, s2 - s1, s3 - s2
        b = [d1, d2 + a[0] * d1, d3 + a[0] * d2 + a[1] * d1]
        return np.array([float(c) for c in (*a, *b)])


def numpy_reading(theta: Array, dt_s: float) -> tuple[float, float, float]:
    """K, omega_n, xi by numpy alone: real root nearest to one out, logarithm of the others."""
    roots = np.roots([1.0, *theta[:3]])
    real = [i for i, z in enumerate(roots) if abs(z.imag) < 1e-7]
    integrator = min(real, key=lambda i: abs(roots[i] - 1.0))
    pair = np.delete(roots, integrator).astype(complex)
    s = np.log(pair) / dt_s
    omega_n = float(np.sqrt(np.prod(s).real))
    gain = float(np.sum(theta[3:]) / (dt_s * np.prod(1.0 - pair).real))
    return gain, omega_n, float(-np.sum(s).real / (2.0 * omega_n))


def within(values: Array, deviations: Array, count: float = 1.959964) -> Array:
    """Share of rows inside count standard deviations (95 % for the default)."""
    return np.mean(np.abs(values) <= count * deviations, axis=0)


# --- forwards ---------------------------------------------------------------------------------


@pytest.mark.parametrize("dt_s", [1e-4, 1e-3, 1e-2])
def test_physical_parameters_agree_with_the_state_space_of_equations_1_to_4(dt_s: float) -> None:
    p = RIG
    # States: position, velocity, load pressure in MPa (balanced, so that expm keeps its digits).
    stiffness = 4.0 * p["beta_e"] / p["v_t"] * 1e-6
    a = np.array(
        [
            [0.0, 1.0, 0.0],
            [0.0, 0.0, p["a_p"] / p["m_t"] * 1e6],
            [0.0, -stiffness * p["a_p"], -stiffness * (p["k_c"] + p["c_p"]) * 1e6],
        ]
    )
    b = np.array([[0.0], [0.0], [stiffness * p["k_q"] * p["k_v"]]])
    c = np.array([[1.0, 0.0, 0.0]])
    sampled = scipy.signal.cont2discrete((a, b, c, np.zeros((1, 1))), dt_s, method="zoh")
    numerator, denominator = scipy.signal.ss2tf(*sampled[:4])
    theta = ehsid.discretise(ehsid.continuous_servo(ehsid.ServoParameters(**p)), dt_s)
    # expm and the eigenvalues behind ss2tf work to about 1e-14 of the largest entry (1e3 here).
    np.testing.assert_allclose(theta[:3], denominator[1:], atol=1e-11)
    np.testing.assert_allclose(theta[3:], numerator[0, 1:], atol=1e-11)


@given(x=phases, xi=dampings)
def test_discretisation_is_exact_to_rounding(x: float, xi: float) -> None:
    theta, exact = unit_theta(x, xi), exact_theta(x, xi)
    # a: absolute, Q(1) up to 4 after up to seven doublings. b: relative, however small; exp(-v)
    # alone is conditioned with v, and up to seven doublings add some four roundings each.
    np.testing.assert_allclose(theta[:3], exact[:3], rtol=0.0, atol=16.0 * EPS)
    np.testing.assert_allclose(theta[3:], exact[3:], rtol=(32.0 + 2.0 * xi * x) * EPS)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((1.0, np.nan, 0.5, DT), "finite"),
        ((1.0, 10.0, 0.5, np.inf), "finite"),
        ((1.0, 0.0, 0.5, DT), "omega_n > 0"),
        ((1.0, 10.0, -0.1, DT), "xi >= 0"),
        ((1.0, 10.0, 0.5, 0.0), "dt_s > 0"),
        ((1.0, 1e-6, 0.5, DT), "1e-6"),
        ((1.0, 1e6, 0.5, DT), "1024"),
        ((1.7e308, 2.0, 0.5, 4.0), "overflows"),
    ],
)
def test_discretise_says_what_is_wrong(
    arguments: tuple[float, float, float, float], words: str
) -> None:
    gain, omega_n, xi, dt_s = arguments
    with pytest.raises(ValueError, match=words) as error:
        ehsid.discretise(servo(gain, omega_n, xi), dt_s)
    assert repr(float(omega_n)) in str(error.value)


@pytest.mark.parametrize("name", sorted(RIG))
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_physical_parameters_outside_their_range_are_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        ehsid.continuous_servo(ehsid.ServoParameters(**{**RIG, name: value}))


# --- backwards --------------------------------------------------------------------------------


def test_model_16_reads_as_numpy_reads_it() -> None:
    reading = ehsid.identify_servo(MODEL_16, NO_COVARIANCE, DT)
    assert reading.status == ehsid.ServoReadingStatus.ok
    # numpy's eigenvalues are good to about 1e-14, amplified by less than 100.
    np.testing.assert_allclose(
        [reading.gain, reading.omega_n, reading.xi], numpy_reading(MODEL_16, DT), rtol=1e-12
    )
    # The figures docs/servo_model.md states.
    np.testing.assert_allclose(
        [reading.gain, reading.omega_n, reading.xi], [6.556, 12.95, 0.471], rtol=5e-4
    )
    assert reading.integrator_pole == pytest.approx(0.99901, abs=5e-6)
    assert reading.integrator_distance == pytest.approx(9.893e-4, rel=1e-3)
    implied = ehsid.discretise(servo(reading.gain, reading.omega_n, reading.xi), DT)[3:]
    mismatch = np.linalg.norm(MODEL_16[3:] - implied) / np.linalg.norm(MODEL_16[3:])
    assert reading.zoh_mismatch == pytest.approx(mismatch, rel=1e-12)
    assert reading.zoh_mismatch == pytest.approx(1.049, abs=5e-4)


@given(
    p=st.floats(0.995, 1.005),
    radius=st.floats(0.1, 0.95),
    angle=st.floats(0.3, 2.9),
    b=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
)
def test_any_readable_theta_reads_as_numpy_reads_it(
    p: float, radius: float, angle: float, b: list[float]
) -> None:
    q1, q2 = -2.0 * radius * np.cos(angle), radius**2
    assume(any(b))
    theta = np.array([q1 - p, q2 - p * q1, -p * q2, *b])
    reading = ehsid.identify_servo(theta, NO_COVARIANCE, DT)
    # Few of all b are by chance those of a servo above half the sampling rate.
    assume(reading.status != ehsid.ServoReadingStatus.aliasing)
    assert reading.status == ehsid.ServoReadingStatus.ok
    gain, omega_n, xi = numpy_reading(theta, DT)
    # Eigenvalues: 1e-14, times at most 1 / (0.1 * 0.3)^2 by the logarithm and the pair's angle.
    assert reading.omega_n == pytest.approx(omega_n, rel=1e-11)
    assert reading.xi == pytest.approx(xi, abs=1e-11)
    assert reading.gain == pytest.approx(gain, rel=1e-11, abs=1e-11)
    assert reading.integrator_pole == pytest.approx(p, abs=1e-12)


@pytest.mark.parametrize(("omega_n", "xi"), [(20.0, 0.4), (12.0, 1.0), (10.0, 1.6)])
def test_intervals_cover_and_mismatch_is_chi_squared(omega_n: float, xi: float) -> None:
    rng = np.random.default_rng(20)
    truth = np.array([0.02, omega_n, xi])
    theta = ehsid.discretise(servo(*truth), DT)
    # A dense covariance, small enough for the first order: deviations of theta about 1e-4 relative
    # to a, and of the size of b relative to b.
    mixing = rng.standard_normal((6, 6)) * np.array([*[3e-5] * 3, *(1e-2 * theta[3:])])[:, None]
    covariance = mixing @ mixing.T
    count = 4000
    draws = theta + rng.standard_normal((count, 6)) @ mixing.T
    readings = [ehsid.identify_servo(draw, covariance, DT) for draw in draws]
    assert all(r.status == ehsid.ServoReadingStatus.ok for r in readings)
    values = np.array([[r.gain, r.omega_n, r.xi, r.integrator_pole] for r in readings])
    deviations = np.array(
        [[r.gain_std, r.omega_n_std, r.xi_std, r.integrator_pole_std] for r in readings]
    )
    share = within(values - [*truth, 1.0], deviations)
    # Binomial: standard deviation 0.0034 at 4000 draws, four of them.
    np.testing.assert_allclose(share, 0.95, atol=4.0 * np.sqrt(0.95 * 0.05 / count))
    # Correlations too: the squared distance of all three in their covariance is chi-squared.
    at_truth = ehsid.identify_servo(theta, covariance, DT).covariance
    errors = values[:, :3] - truth
    distance = np.einsum("ni,ij,nj->n", errors, np.linalg.inv(at_truth), errors)
    assert scipy.stats.kstest(distance, scipy.stats.chi2(3).cdf).pvalue > 1e-3
    chi2 = np.array([r.zoh_mismatch_chi2 for r in readings])
    assert scipy.stats.kstest(chi2, scipy.stats.chi2(2).cdf).pvalue > 1e-3


def test_covariance_need_not_be_contiguous_nor_double() -> None:
    theta = ehsid.discretise(servo(0.02, 20.0, 0.4), DT)
    rng = np.random.default_rng(1)
    mixing = 1e-5 * rng.standard_normal((6, 6))
    covariance = mixing @ mixing.T
    plain = ehsid.identify_servo(theta, covariance, DT)
    for same in (np.asfortranarray(covariance), covariance.tolist()):
        assert ehsid.identify_servo(theta, same, DT).gain_std == plain.gain_std
    np.testing.assert_array_equal(plain.covariance.shape, (3, 3))
    np.testing.assert_allclose(
        np.sqrt(np.diag(plain.covariance)), [plain.gain_std, plain.omega_n_std, plain.xi_std]
    )


def poles(*values: complex, b: float = 0.1) -> Array:
    return np.array([*np.poly(values)[1:].real, b, b, b])


READABLE = (1.0, 0.6 + 0.4j, 0.6 - 0.4j)


@pytest.mark.parametrize(
    ("theta", "variance", "status"),
    [
        (poles(*READABLE), 0.0, "ok"),
        (poles(1.0, np.nan, 0.5), 0.0, "not_finite"),
        (poles(*READABLE), -1e-9, "invalid_argument"),
        (poles(0.9, 0.6 + 0.4j, 0.6 - 0.4j), 0.0, "no_integrator"),
        (poles(*READABLE), 1.0, "poles_not_separable"),
        (poles(1.0, 0.5, 0.0), 0.0, "pole_near_zero"),
        (poles(1.0, 0.5, -0.2), 0.0, "negative_real_pole"),
        (poles(1.0, 0.9 + 0.5j, 0.9 - 0.5j), 0.0, "unstable_pole"),
        (poles(1.0, -0.7 + 0.02j, -0.7 - 0.02j), 0.0, "aliasing"),
        (poles(*READABLE, b=0.0), 0.0, "no_gain"),
    ],
)
def test_each_reason_has_a_code_and_words(theta: Array, variance: float, status: str) -> None:
    reading = ehsid.identify_servo(theta, variance * np.eye(6), DT)
    assert reading.status.name == status
    assert (status == "ok") == bool(np.isfinite(reading.omega_n))
    of_gain = ("ok", "pole_near_zero", "negative_real_pole", "aliasing")
    assert np.isfinite(reading.gain) == (status in of_gain)
    assert reading.description
    assert reading.description != "unknown status"
    assert (reading.description in repr(reading)) == (status != "ok")


@pytest.mark.parametrize(
    ("pair", "status"),
    [
        ((0.6 + 0.4j, 0.6 - 0.4j), "ok"),
        ((0.5, 0.0), "pole_near_zero"),
        ((0.8, -0.6), "negative_real_pole"),
        ((-0.7 + 0.02j, -0.7 - 0.02j), "aliasing"),
    ],
)
def test_gain_is_the_velocity_whatever_the_stable_pair(
    pair: tuple[complex, complex], status: str
) -> None:
    theta = poles(1.0, *pair)
    deviations = 1e-5 * np.arange(1.0, 7.0)
    reading = ehsid.identify_servo(theta, np.diag(deviations**2), DT)
    assert reading.status.name == status

    def velocity(values: Array) -> float:
        # The integrator at exactly z = 1, as the other poles of this theta have it.
        z = np.roots([1.0, *values[:3]])
        rest = np.delete(z, np.argmin(np.abs(z - 1.0)))
        a = np.convolve([1.0, -1.0], np.poly(rest).real)
        step = scipy.signal.lfilter(np.concatenate(([0.0], values[3:])), a, np.ones(300))
        return float(step[-1] - step[-2]) / DT

    assert reading.gain == pytest.approx(velocity(theta), rel=1e-9)
    h = 1e-6 * np.eye(6)
    slope = np.array([(velocity(theta + d) - velocity(theta - d)) / 2e-6 for d in h])
    # Central differences: h^2 times the third derivative, and rounding of the sum over h.
    assert reading.gain_std == pytest.approx(float(np.hypot.reduce(slope * deviations)), rel=1e-5)
    assert np.isfinite(reading.omega_n) == (status == "ok")


def test_every_status_has_words_of_its_own() -> None:
    covariance = np.diag([0.0, 0.0, 0.0, 1e-6, 1e-6, 0.0])
    covariance[3, 4] = covariance[4, 3] = -2e-6  # not positive semidefinite
    reading = ehsid.identify_servo(poles(*READABLE), covariance, DT)
    assert reading.status == ehsid.ServoReadingStatus.numerical_limit
    assert "positive semidefinite" in reading.description
    assert len(ehsid.ServoReadingStatus) == 11


@pytest.mark.parametrize(
    ("theta", "covariance", "words"),
    [
        (np.zeros(4), NO_COVARIANCE, r"theta has shape \(4,\)"),
        (np.zeros(5), NO_COVARIANCE, r"covariance has shape \(6, 6\), expected \(5, 5\)"),
        (np.zeros((6, 1)), NO_COVARIANCE, r"theta has shape \(6, 1\)"),
        (np.zeros(6), np.zeros((6, 5)), r"covariance has shape \(6, 5\)"),
        (np.zeros(6), np.zeros((5, 6)), r"covariance has shape \(5, 6\), expected \(6, 6\)"),
        (np.zeros(6), np.zeros(6), r"covariance has shape \(6,\)"),
    ],
)
def test_other_shapes_are_refused(theta: Array, covariance: Array, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ehsid.identify_servo(theta, covariance, DT)


def noisy_estimate(omega_dt: float, xi: float, noise: float, seed: int) -> tuple[Array, Array]:
    """theta and covariance of least squares on 1,000 samples; noise relative to the increments."""
    rng = np.random.default_rng(seed)
    servo = ehsid.ContinuousServo(gain=1.0, omega_n=omega_dt, xi=xi)
    theta = np.asarray(ehsid.discretise(servo, 1.0))
    a, b = np.concatenate(([1.0], theta[:3])), np.concatenate(([0.0], theta[3:]))
    u = rng.choice([-1.0, 1.0], size=1000)
    y = scipy.signal.lfilter(b, a, u)
    error = noise * np.std(np.diff(y)) * rng.normal(size=u.size)
    y = y + scipy.signal.lfilter([1.0], a, error)
    phi = np.column_stack([-y[2:-1], -y[1:-2], -y[:-3], u[2:-1], u[1:-2], u[:-3]])
    found, *_ = np.linalg.lstsq(phi, y[3:], rcond=None)
    variance = np.sum((y[3:] - phi @ found) ** 2) / (phi.shape[0] - 6)
    return found, variance * np.linalg.inv(phi.T @ phi)


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 1e-1])
def test_aliased_servos_are_not_read_as_slower_ones(noise: float) -> None:
    """omega_n dt of 3.3 to 9; at a noise of 10 % at most 3 % of the readings are wrong."""
    rng = np.random.default_rng(5)
    wrong = 0
    for seed in range(200):
        omega_dt, xi = rng.uniform(3.3, 9.0), np.exp(rng.uniform(np.log(0.02), np.log(0.3)))
        reading = ehsid.identify_servo(*noisy_estimate(omega_dt, xi, noise, seed), 1.0)
        wrong += reading.status.name == "ok"
    assert wrong <= (6 if noise > 0.05 else 0)


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 1e-1])
def test_servos_below_half_the_sampling_rate_are_not_called_aliased(noise: float) -> None:
    """omega_n dt from 0.05 to 2.9; beyond it the angle itself reaches pi within its uncertainty."""
    rng = np.random.default_rng(6)
    for seed in range(200):
        omega_dt, xi = rng.uniform(0.05, 2.9), np.exp(rng.uniform(np.log(0.02), np.log(1.2)))
        theta, covariance = noisy_estimate(omega_dt, xi, noise, seed)
        reading = ehsid.identify_servo(theta, covariance, 1.0)
        angle = np.abs(np.angle(np.roots(np.concatenate(([1.0], theta[:3]))))).max()
        assert reading.status.name != "aliasing" or angle > 2.8


def after(samples: int, sensor_noise: float = 0.0, **settings: Any) -> ehsid.ArxEstimator:
    """Returns an estimator that has seen model (16), whose null is not at zero."""
    na = 2 if settings.get("integrator") else 3
    estimator = ehsid.ArxEstimator(na, 3, 1, **settings)
    rng = np.random.default_rng(5)
    u, y = np.zeros(samples), np.zeros(samples)
    for k in range(samples):
        if k >= 3:
            acts = u[k - 3 : k][::-1] + 0.2
            y[k] = -MODEL_16[:3] @ y[k - 3 : k][::-1] + MODEL_16[3:] @ acts
            y[k] += 0.0 if sensor_noise else 1e-3 * rng.normal()
        u[k] = 1.0 if rng.normal() > 0.01 * y[k] else -1.0
    estimator.run(u, y + sensor_noise * rng.normal(size=samples))
    return estimator


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("offset", [False, True])
@pytest.mark.parametrize("settings", [{}, {"integrator": True}, {"method": "riv"}])
def test_servo_of_an_estimator_is_that_of_its_theta_and_covariance(
    settings: dict[str, Any], offset: bool, dtype: str
) -> None:
    if settings.get("method") == "riv":
        settings = settings | {"forgetting": ehsid.Exponential()}
    estimator = after(900, **settings, offset=offset, dtype=dtype)
    n = 5 if settings.get("integrator") else 6
    told = estimator.servo(DT)
    read = ehsid.identify_servo(estimator.theta_hat[:n], estimator.covariance[:n, :n], DT)
    assert told.status == read.status
    for name in ("gain", "omega_n", "xi", "gain_std", "omega_n_std", "xi_std", "covariance"):
        np.testing.assert_array_equal(getattr(told, name), getattr(read, name))
    assert told.residual_std == np.sqrt(estimator.residual_variance)
    assert np.isnan(read.residual_std)
    assert not read.trusted


def test_servo_of_an_estimator_says_what_the_residuals_say() -> None:
    good = after(900, offset=True).servo(DT)
    assert good.trusted
    assert good.reason == ehsid.TrustReason.trusted
    assert abs(good.gain - 6.556) < 3.0 * good.gain_std
    assert after(20, offset=True).servo(DT).reason == ehsid.TrustReason.not_precise
    assert after(200, offset=True).servo(DT).reason == ehsid.TrustReason.starting
    noisy = after(900, sensor_noise=2e-2, offset=True).servo(DT)
    assert noisy.reason == ehsid.TrustReason.model_does_not_fit


@pytest.mark.parametrize(
    ("orders", "integrator", "words"),
    [
        ((2, 2, 1), False, "has na = 2, nb = 2, nk = 1; .* expected na = 3, nb = 3 and nk >= 1"),
        ((3, 3, 0), False, "has na = 3, nb = 3, nk = 0"),
        ((3, 3, 1), True, "beside the known integrator; expected na = 2, nb = 3"),
    ],
)
def test_servo_of_other_orders_is_refused(
    orders: tuple[int, int, int], integrator: bool, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        ehsid.ArxEstimator(*orders, integrator=integrator).servo(DT)


@pytest.mark.parametrize("seed", [7000, 7001, 7002])
@pytest.mark.parametrize("dead_band_v", [0.0, 0.3])
@pytest.mark.parametrize("settings", [{}, {"integrator": True}])
def test_least_squares_are_not_trusted_on_a_servo_with_a_noisy_position_sensor(
    settings: dict[str, Any], dead_band_v: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    servo = ehsid.ContinuousServo(gain=rng.uniform(0.02, 0.05), omega_n=25.0, xi=0.3)
    theta = ehsid.discretise(servo, 0.005)
    u = np.repeat(rng.uniform(-2.0, 2.0, 250), 16)
    acts = np.sign(u) * np.maximum(np.abs(u) - dead_band_v, 0.0)
    y = np.zeros(u.size)
    for k in range(3, u.size):
        y[k] = -theta[:3] @ y[k - 3 : k][::-1] + theta[3:] @ acts[k - 3 : k][::-1]
    na = 2 if settings else 3
    estimator = ehsid.ArxEstimator(na, 3, 1, offset=True, **settings)
    estimator.run(u, y + rng.normal(scale=2e-5, size=u.size))
    told = estimator.servo(0.005)
    # omega_n is read with a large error; the reason has to say so.
    assert not abs(told.omega_n / servo.omega_n - 1.0) < 0.1
    assert told.reason == ehsid.TrustReason.model_does_not_fit
