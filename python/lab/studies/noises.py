# SPDX-License-Identifier: MIT
"""Which recursion is right with which noise: model (16) as the known plant, many runs.

Each noise enters model (16) at another place. Each method runs over the same records, through the
C++ estimator. Counted is how often the truth lies inside the deviations that the method reports.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

import ehsid
from ehsid.harness.base.numbers import FloatArray

from .rig_records import DT_S, MODEL_16

THETA = np.array(MODEL_16)
A, B = np.concatenate(([1.0], THETA[:3])), np.concatenate(([0.0], THETA[3:]))

N_SAMPLES = 2000
POSITION_SCALE = 4.0
"""Of the estimator; the standard deviation of the position is 2 to 8 in these records."""

NORMAL_90 = 1.6448536269514722
"""Half width of a two-sided 90 % interval of a normal distribution, in standard deviations."""

METHODS = ("rls", "riv")

FORGETTING = ehsid.Exponential(lambda0=0.995, lambda_initial=0.98)
"""Of every method: forgets what the first samples taught while the running model was wrong."""


@dataclass(frozen=True)
class Noise:
    """How noise enters model (16)."""

    name: str
    """In words."""
    sensor_fit: float | None = None
    """Simulation fit in percent that white noise of the position sensor leaves; None for none."""
    equation: float = 0.0
    """Standard deviation of white e in A y = B u + C e; 0 for none."""
    c: float = 0.0
    """C = 1 + c q^-1."""


NOISES = (
    Noise("white equation noise", equation=0.05),
    Noise("equation noise, C = 1 + 0.7 q^-1", equation=0.05, c=0.7),
    Noise("sensor noise, fit 99 %", sensor_fit=99.0),
    Noise("sensor noise, fit 97 %", sensor_fit=97.0),
    Noise("sensor noise, fit 95 %", sensor_fit=95.0),
)

COMMANDS = ("binary", "gaussian", "prbs")
"""White +-1, white Gaussian, and +-1 held for three samples each."""


@dataclass(frozen=True, eq=False)
class Signals:
    """Command, position without and with noise, each of shape (N,), and the noise at the sensor."""

    u: FloatArray
    x: FloatArray
    y: FloatArray
    sigma: float


def signals(noise: Noise, seed: int, command: str = "binary", n: int = N_SAMPLES) -> Signals:
    """Makes one record of model (16), from rest."""
    rng = np.random.default_rng(seed)
    if command == "gaussian":
        u = rng.standard_normal(n)
    else:
        hold = 3 if command == "prbs" else 1
        u = np.repeat(rng.choice([-1.0, 1.0], n // hold + 1), hold)[:n]
    x = np.asarray(lfilter(B, A, u))
    e = noise.equation * rng.standard_normal(n)
    y = x + np.asarray(lfilter([1.0, noise.c], A, e))
    sigma = 0.0
    if noise.sensor_fit is not None:
        sigma = float(np.std(x)) * (1.0 - noise.sensor_fit / 100.0)
        y = y + sigma * rng.standard_normal(n)
    return Signals(u, x, y, sigma)


def estimator(
    method: str, dtype: str = "float32", forgetting: ehsid.Forgetting = FORGETTING
) -> ehsid.ArxEstimator:
    """Returns an estimator of model (16) with the settings of this study."""
    return ehsid.ArxEstimator(
        3,
        3,
        1,
        forgetting=forgetting,
        scaling=ehsid.Scaling(position_scale=POSITION_SCALE),
        reset=None,
        method=method,
        dtype=dtype,
    )


@dataclass(frozen=True, eq=False)
class Runs:
    """What one method gave over R records."""

    theta: FloatArray
    deviation: FloatArray
    """Shape (R, 6), estimate at the end and its standard deviation."""
    reading: FloatArray
    """Shape (R, 3), K, omega_n and xi of theta; NaN where theta is no servo."""

    @property
    def distance(self) -> FloatArray:
        """Errors in own standard deviations, shape (R, 6)."""
        return np.asarray(np.abs(self.theta - THETA) / self.deviation)

    @property
    def error(self) -> float:
        """Median of |theta - truth| / |truth|."""
        away = np.linalg.norm(self.theta - THETA, axis=1)
        return float(np.median(away) / np.linalg.norm(THETA))

    @property
    def coverage(self) -> float:
        """Share of the 90 % intervals that contain the true parameter."""
        return float(np.mean(self.distance < NORMAL_90))

    @property
    def within_three(self) -> float:
        """Share of the runs whose worst parameter is within three of its deviations."""
        return float(np.mean(self.distance.max(axis=1) < 3.0))

    @property
    def reading_bias(self) -> FloatArray:
        """Median of K, omega_n and xi over the runs, relative to the truth, minus one."""
        return np.asarray(np.nanmedian(self.reading, axis=0) / read(THETA) - 1.0)

    @property
    def reading_error(self) -> FloatArray:
        """Median of the absolute relative errors of K, omega_n and xi."""
        return np.asarray(np.nanmedian(np.abs(self.reading / read(THETA) - 1.0), axis=0))


def read(theta: FloatArray) -> FloatArray:
    """Returns K, omega_n and xi of theta, all NaN where it is no servo."""
    servo = ehsid.identify_servo(theta, np.zeros((6, 6)), DT_S)
    values = np.array([servo.gain, servo.omega_n, servo.xi])
    return values if servo.status == ehsid.ServoReadingStatus.ok else np.full(3, np.nan)


def run(
    method: str,
    noise: Noise,
    seeds: Sequence[int],
    command: str = "binary",
    dtype: str = "float32",
    n: int = N_SAMPLES,
    forgetting: ehsid.Forgetting = FORGETTING,
) -> Runs:
    """Runs one method over a record for each seed."""
    records = [signals(noise, seed, command, n) for seed in seeds]
    recursions = [estimator(method, dtype, forgetting) for _ in records]
    if method == "rls" and records:
        bank = ehsid.EstimatorBank(recursions)
        bank.run(
            np.column_stack([record.u for record in records]),
            np.column_stack([record.y for record in records]),
            every=0,
        )
        recursions = [bank[i] for i in range(len(bank))]
    else:
        for recursion, record in zip(recursions, records, strict=True):
            recursion.run(record.u, record.y)
    theta, deviation = [], []
    for recursion in recursions:
        theta.append(np.asarray(recursion.theta_hat, dtype=np.float64))
        deviation.append(plain_deviation(recursion))
    return Runs(np.array(theta), np.array(deviation), np.array([read(row) for row in theta]))


def plain_deviation(recursion: ehsid.ArxEstimator) -> FloatArray:
    """Returns the deviations of sigma^2 P, without what residuals that are not white add."""
    told = np.asarray(recursion.standard_deviation, dtype=np.float64)
    return told if recursion.residuals_white else told / np.sqrt(1.0 + recursion.whiteness)


def simulated(theta: FloatArray, u: FloatArray) -> FloatArray:
    """Position of the model, from rest."""
    a, b = np.concatenate(([1.0], theta[:3])), np.concatenate(([0.0], theta[3:]))
    return np.asarray(lfilter(b, a, u))


def gradient(theta: FloatArray, u: FloatArray) -> FloatArray:
    """Derivative of `simulated` with respect to theta, shape (N, 6)."""
    x = simulated(theta, u)
    columns = np.zeros((u.size, 6))
    for i in range(3):
        columns[i + 1 :, i] = -x[: -i - 1]
        columns[i + 1 :, 3 + i] = u[: -i - 1]
    return np.asarray(lfilter([1.0], np.concatenate(([1.0], theta[:3])), columns, axis=0))


def bound(record: Signals) -> FloatArray:
    """Cramer-Rao bound with white noise of the sensor: the least covariance of theta."""
    psi = gradient(THETA, record.u)
    return np.asarray(record.sigma**2 * np.linalg.inv(psi.T @ psi))


def batch(record: Signals) -> tuple[FloatArray, FloatArray]:
    """Least squares of the output error over the whole record with scipy, from the true parameters.

    What an estimator with all samples in memory reaches. Returns theta and its deviations.
    """

    def residual(theta: FloatArray) -> FloatArray:
        return simulated(theta, record.u) - record.y

    def slope(theta: FloatArray) -> FloatArray:
        return gradient(theta, record.u)

    found = least_squares(
        residual,
        THETA,
        slope,
        x_scale="jac",
        xtol=1e-12,
        ftol=1e-12,
    )
    jacobian = gradient(found.x, record.u)
    variance = 2.0 * found.cost / (record.u.size - THETA.size)
    covariance = variance * np.linalg.inv(jacobian.T @ jacobian)
    return np.asarray(found.x), np.sqrt(np.diag(covariance))


def run_batch(
    noise: Noise, seeds: Sequence[int], command: str = "binary", n: int = N_SAMPLES
) -> Runs:
    """The same as `run` with `batch`."""
    pairs = [batch(signals(noise, seed, command, n)) for seed in seeds]
    theta = [theta for theta, _ in pairs]
    return Runs(
        np.array(theta),
        np.array([deviation for _, deviation in pairs]),
        np.array([read(row) for row in theta]),
    )


PUBLISHED_FIT = Noise("noise of the sensor, published fit", sensor_fit=95.48)
"""The paper's fit of its third-order model, taken as noise of the position sensor."""


def on_noisy_sensor(seeds: Sequence[int]) -> dict[str, Runs]:
    """Runs the paper's three forgetting factors, and the method for this noise, on model (16)."""
    factors: dict[str, ehsid.Forgetting] = {
        "least squares, varying, Eq. (15)": ehsid.Exponential(),
        "least squares, lambda = 0.99": ehsid.Constant(0.99),
        "least squares, lambda = 1": ehsid.Constant(1.0),
    }
    found = {
        name: run("rls", PUBLISHED_FIT, seeds, forgetting=policy)
        for name, policy in factors.items()
    }
    return found | {"instrumental variables": run("riv", PUBLISHED_FIT, seeds)}
