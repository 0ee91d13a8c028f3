# SPDX-License-Identifier: MIT
"""ServoEstimator on an ordinary servo: noise on the sensor, a P loop, and a plant that changes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import scipy.signal

import ehsid

FloatArray = npt.NDArray[np.float64]
GAIN, OMEGA_N, XI = 0.03, 25.0, 0.3
SECONDS, CHANGE_S = 60.0, 30.0


def record(dt_s: float, seed: int, noise_m: float = 5e-6) -> tuple[FloatArray, FloatArray]:
    """Return command in V and position in m: steps of +-20 mm, and K + 50 % in the middle."""
    random = np.random.default_rng(seed)
    count = round(SECONDS / dt_s)
    command, position = np.zeros(count), np.zeros(count)
    x = v = a = 0.0
    steps = int(np.ceil(dt_s * OMEGA_N / 0.005))
    step = dt_s / steps
    for k in range(count):
        gain = GAIN if k * dt_s < CHANGE_S else 1.5 * GAIN
        position[k] = x + random.normal(0.0, noise_m)
        target = 0.02 if (k * dt_s) % 1.2 < 0.6 else -0.02
        command[k] = np.clip(4.0 / GAIN * (target - position[k]), -10.0, 10.0)
        for _ in range(steps):
            a += step * (OMEGA_N**2 * (gain * command[k] - v) - 2.0 * XI * OMEGA_N * a)
            v += step * a
            x += step * v
    return command, position


@pytest.mark.slow
@pytest.mark.parametrize("dt_s", [0.01, 0.02])
def test_the_gain_is_right_and_trusted_before_and_after_a_change(dt_s: float) -> None:
    run = ehsid.ServoEstimator(dt_s).run(*record(dt_s, seed=3))
    before, after = round(CHANGE_S / dt_s) - 1, -1
    for at, gain in ((before, GAIN), (after, 1.5 * GAIN)):
        assert run.gain.value[at] == pytest.approx(gain, rel=0.05)
        assert run.gain.trusted[at]
        # The servo of this test is a semi-implicit Euler method: omega_n within 0.5 %.
        assert run.omega_n.value[at] == pytest.approx(OMEGA_N, rel=0.1)
        assert run.xi.value[at] == pytest.approx(XI, abs=0.1)
    wrong = np.abs(run.gain.value[before + 1 :] / (1.5 * GAIN) - 1.0) > 0.1
    assert np.mean(wrong & run.gain.trusted[before + 1 :]) < 0.03


def test_a_run_is_its_steps_bit_for_bit() -> None:
    command, position = record(0.02, seed=4)
    run = ehsid.ServoEstimator(0.02).run(command[:500], position[:500])
    stepped = ehsid.ServoEstimator(0.02)
    for k in range(500):
        assert stepped.step(command[k], position[k]) == run.status[k]
        told = stepped.servo()
        for one, series in (
            (told.gain, run.gain),
            (told.omega_n, run.omega_n),
            (told.xi, run.xi),
        ):
            assert np.float32(one.value).tobytes() == series.value[k].tobytes()
            assert np.float32(one.half_width).tobytes() == series.half_width[k].tobytes()
            assert (one.trusted, one.reason) == (series.trusted[k], series.reason[k])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"dt_s": 0.0}, "dt_s and tolerance must be finite and > 0"),
        ({"dt_s": np.nan}, "dt_s and tolerance"),
        ({"dt_s": 0.01, "delay": 0}, "delay"),
        ({"dt_s": 0.01, "delay": 21}, "delay"),
        ({"dt_s": 0.01, "drift": -1.0}, "drift finite and >= 0"),
        ({"dt_s": 0.01, "tolerance": 0.0}, "tolerance"),
        ({"dt_s": 0.01, "dtype": "int32"}, "dtype"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ehsid.ServoEstimator(**arguments)  # type: ignore[arg-type]


def test_signals_of_unequal_length_are_refused() -> None:
    estimator = ehsid.ServoEstimator(0.01)
    with pytest.raises(ValueError, match="position"):
        estimator.run(np.zeros(5), np.zeros(4))
    assert estimator.servo().gain.reason == ehsid.TrustReason.starting


@pytest.mark.slow
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("delay", [1, 3])
@pytest.mark.parametrize(
    "end", [10, 3100, *(pytest.param(end, marks=pytest.mark.thorough) for end in (150, 1500))]
)
def test_what_was_saved_goes_on_bit_for_bit(end: int, delay: int, dtype: str) -> None:
    command, position = record(0.01, seed=6)
    first = ehsid.ServoEstimator(0.01, delay=delay, dtype=dtype)
    first.run(command[:end], position[:end])
    second = ehsid.ServoEstimator(0.01, delay=delay, dtype=dtype)
    second.restore(first.save())
    rest = slice(end, end + 500)
    one, other = (each.run(command[rest], position[rest]) for each in (first, second))
    for name in ("gain", "omega_n", "xi"):
        for part in ("value", "half_width", "trusted", "reason"):
            ours, theirs = getattr(getattr(one, name), part), getattr(getattr(other, name), part)
            assert ours.tobytes() == theirs.tobytes()
    assert first.save() == second.save()


def test_a_state_of_another_estimator_is_refused() -> None:
    saved = ehsid.ServoEstimator(0.01).save()
    for other, words in (
        (ehsid.ServoEstimator(0.01, dtype="float64"), "dtype"),
        (ehsid.ServoEstimator(0.01, delay=2), "delay"),
        (ehsid.ServoEstimator(0.02), "configuration"),
    ):
        before = other.save()
        with pytest.raises(ValueError, match=words):
            other.restore(saved)
        assert other.save() == before
    with pytest.raises(ValueError, match="damaged"):
        ehsid.ServoEstimator(0.01).restore(saved[:-1] + bytes([saved[-1] ^ 1]))


@pytest.mark.slow
@pytest.mark.parametrize(("dtype", "sign"), [("float32", 1.0), ("float64", -1.0)])
def test_the_discrete_model_is_that_of_the_servo_with_its_covariance(
    dtype: str, sign: float
) -> None:
    """Against the matrix exponential, and its differences by K, omega_n and xi."""
    dt_s = 0.02
    estimator = ehsid.ServoEstimator(dt_s, dtype=dtype)
    assert all(np.isnan(part).all() for part in estimator.model())
    command, position = record(dt_s, seed=5)
    estimator.run(command[:1400], sign * position[:1400])
    told = estimator.servo()
    values = np.array([told.gain.value, told.omega_n.value, told.xi.value])

    def coefficients(at: FloatArray) -> FloatArray:
        gain, omega_n, xi = at
        numerator, denominator, _ = scipy.signal.cont2discrete(
            ([gain * omega_n**2], [1.0, 2.0 * xi * omega_n, omega_n**2, 0.0]), dt_s
        )
        return np.concatenate([denominator[1:], numerator[0, 1:]])

    theta, covariance = estimator.model()
    # scipy makes the polynomials from the poles, of which two to three lie close together.
    np.testing.assert_allclose(theta, coefficients(values), rtol=1e-8, atol=2e-11)
    # Central differences with a step of 1e-4 are right to 1e-8 and to the 1e-13 / 1e-4 of scipy.
    jacobian = np.array(
        [
            (coefficients(values + step) - coefficients(values - step)) / 2e-4
            for step in np.diag(1e-4 * values)
        ]
    ).T
    widths = np.array([told.gain.half_width, told.omega_n.half_width, told.xi.half_width])
    back = np.linalg.pinv(jacobian)
    logarithms = back @ covariance @ back.T
    np.testing.assert_allclose(
        jacobian @ logarithms @ jacobian.T, covariance, rtol=1e-4, atol=1e-6 * covariance.max()
    )
    deviations = np.sqrt(np.diag(logarithms))
    np.testing.assert_allclose(1.645 * deviations, widths / np.abs(values), rtol=1e-4)
    assert np.abs(logarithms[0, 1]) < deviations[0] * deviations[1]


@pytest.mark.slow
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("dt_s", [0.005, 0.02, 0.05])
def test_the_discrete_model_is_read_as_the_servo_that_it_was_made_of(
    dt_s: float, dtype: str
) -> None:
    """The covariance has rank 3, so that rounding makes some variances of nothing negative."""
    estimator = ehsid.ServoEstimator(dt_s, dtype=dtype)
    command, position = record(dt_s, seed=3)
    for part in np.array_split(np.arange(round(CHANGE_S / dt_s)), 30)[3:]:
        estimator.run(command[part], position[part])
        told, reading = estimator.servo(), ehsid.identify_servo(*estimator.model(), dt_s)
        if np.isnan(told.gain.value):
            continue
        assert reading.status == ehsid.ServoReadingStatus.ok
        for name in ("gain", "omega_n", "xi"):
            value = getattr(told, name)
            # What servo() tells has the digits of float32.
            assert getattr(reading, name) == pytest.approx(value.value, rel=1e-6)
            half_width = 1.645 * getattr(reading, f"{name}_std")
            assert half_width == pytest.approx(value.half_width, rel=1e-5)
