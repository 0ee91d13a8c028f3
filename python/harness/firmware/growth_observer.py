# SPDX-License-Identifier: MIT
"""The linear servo of a `GrowthMonitor`, with the observer whose innovations are smallest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_discrete_are
from scipy.optimize import minimize
from scipy.signal import lfilter

from ..base.numbers import FloatArray

MOST_FITTED = 15_000
"""Samples of a record from which the observer is found."""


@dataclass(frozen=True, eq=False)
class Observer:
    """Linear servo with the observer whose innovations are smallest."""

    gain: float
    omega_n: float
    xi: float
    delay: int
    transition: FloatArray
    """Shape (3, 3), over a period, of position, velocity and acceleration in units of one."""
    by_command: FloatArray
    """Shape (3,)."""
    correction: FloatArray
    """Shape (3,)."""

    @classmethod
    def of(cls, values: FloatArray, delay: int, dt_s: float) -> Observer:
        """Makes it of K, omega_n, xi and the variance of a disturbance at the command.

        The variance is relative to that of the sensor. The correction is that of the stationary
        Kalman filter.
        """
        gain, omega_n, xi, disturbance = values
        h = omega_n * dt_s
        flow = np.zeros((4, 4))
        flow[0, 1] = flow[1, 2] = 1.0
        flow[2, 1:] = -h * h, -2.0 * xi * h, h * h * gain * dt_s
        step = expm(flow)
        f, g = step[:3, :3], step[:3, 3]
        read = np.array([[1.0, 0.0, 0.0]])
        noise = disturbance * np.outer(g, g) + 1e-12 * np.eye(3)
        p = solve_discrete_are(f.T, read.T, noise, np.eye(1))
        return cls(gain, omega_n, xi, delay, f, g, p[:, 0] / (p[0, 0] + 1.0))

    def _filter(self, u: FloatArray) -> FloatArray:
        return np.concatenate([np.zeros(self.delay - 1), u])[: u.size]

    def innovations(self, u: FloatArray, y: FloatArray) -> FloatArray:
        """Innovations over a record, shape (N,), in double precision."""
        f, g = self.transition, self.by_command
        closed = f - np.outer(f @ self.correction, [1.0, 0.0, 0.0])
        a, c = (np.real(np.poly(np.linalg.eigvals(m))) for m in (f, closed))
        b = np.real(np.poly(np.linalg.eigvals(f - np.outer(g, [1.0, 0.0, 0.0])))) - a
        y_part = lfilter(a, c, y - y[0])
        return np.asarray(y_part - lfilter(b, c, self._filter(u)), dtype=np.float64)

    def accelerations(self, u: FloatArray) -> FloatArray:
        """Acceleration of the model on the commands alone, shape (N,)."""
        f, g = self.transition[1:, 1:], self.by_command[1:]
        a = np.real(np.poly(np.linalg.eigvals(f)))
        b = np.real(np.poly(np.linalg.eigvals(f - np.outer(g, [0.0, 1.0])))) - a
        return np.asarray(lfilter(b, a, self._filter(u)), dtype=np.float64)

    @property
    def settle(self) -> int:
        """Samples until the start is forgotten to a thousandth."""
        closed = (np.eye(3) - np.outer(self.correction, [1.0, 0.0, 0.0])) @ self.transition
        rates = [np.abs(np.linalg.eigvals(m)).max() for m in (closed, self.transition[1:, 1:])]
        return min(10_000, math.ceil(math.log(1e-3) / math.log(max(rates))) + 1)

    def numbers(self, dt_s: float) -> FloatArray:
        """K dt, S, W, E, I, decay and pull as in servo_transition.hpp, shape (7,)."""
        f = self.transition
        return np.array(
            [self.gain * dt_s, 1 - f[0, 1], 1 - f[1, 1], f[1, 2], f[0, 2], f[2, 2], -f[2, 1]]
        )


def fit_observer(u: FloatArray, y: FloatArray, dt_s: float, gain: float) -> Observer:
    """Finds the observer with the smallest innovations; `gain` is where the search begins."""
    found: tuple[float, Observer] | None = None
    u, y = u[:MOST_FITTED], y[:MOST_FITTED]
    for delay in (1, 2, 3):

        def size(logs: FloatArray, delay: int = delay) -> float:
            h, xi = math.exp(logs[1]) * dt_s, math.exp(logs[2])
            if not (0.01 < h < 1.5 and 0.1 < xi < 2.0 and logs[3] < 40.0):
                return math.inf
            innovations = Observer.of(np.exp(logs), delay, dt_s).innovations(u, y)[200:]
            return math.log(float(np.var(innovations)))

        start = np.log([abs(gain), min(250.0, 0.5 / dt_s), 0.7, 4e9])
        steps = np.vstack([start, start + np.diag([0.1, 0.4, 0.4, 2.0])])
        best = minimize(
            size,
            start,
            method="Nelder-Mead",
            options={"initial_simplex": steps, "maxiter": 150, "xatol": 1e-2, "fatol": 1e-4},
        )
        if found is None or best.fun < found[0]:
            found = best.fun, Observer.of(np.exp(best.x), delay, dt_s)
    assert found is not None
    return found[1]
