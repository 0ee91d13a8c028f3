# SPDX-License-Identifier: MIT
"""Signals that every recursion gets, and the parameters that batch least squares finds for them.

All signals are rounded to float32 first, so that recursions in float and in double get the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.signal

from ehsid.harness.base.numbers import FloatArray

# Model (16) of Ghazali et al. (2011).
A16 = np.array([-2.2390, 1.7820, -0.5427])
B16 = np.array([0.3850, -0.5810, 0.2954])


@dataclass(frozen=True, eq=False)
class Series:
    """Commands and outputs of an ARX model with delay one, and its orders."""

    u: FloatArray
    y: FloatArray
    """Shape (N,)."""
    na: int
    nb: int
    """orders: phi(k) = (-y(k-1) .. -y(k-na), u(k-1) .. u(k-nb))."""

    @property
    def first(self) -> int:
        """The first sample whose regressor is complete."""
        return max(self.na, self.nb)

    @property
    def parameters(self) -> int:
        """Number of parameters, n."""
        return self.na + self.nb

    def regressors(self, stop: int | None = None) -> tuple[FloatArray, FloatArray]:
        """Phi of shape (stop - first, n), and y of shape (stop - first,)."""
        k = np.arange(self.first, self.u.size if stop is None else stop)
        past = [-self.y[k - i] for i in range(1, self.na + 1)]
        return np.column_stack([*past, *(self.u[k - i] for i in range(1, self.nb + 1))]), self.y[k]

    def write(self, path: Path) -> None:
        """Writes u, then y, as the program in cpp/ reads them."""
        np.concatenate((self.u, self.y)).astype(np.float64).tofile(path)


def simulated(a: FloatArray, b: FloatArray, u: FloatArray, noise: FloatArray) -> Series:
    """A(q^-1) y(k) = B(q^-1) u(k-1) + e(k) from rest, rounded to float32."""
    equation = np.convolve(u, np.concatenate(([0.0], b)))[: u.size] + noise
    y = scipy.signal.lfilter([1.0], np.concatenate(([1.0], a)), equation)
    return Series(
        u.astype(np.float32).astype(np.float64),
        np.asarray(y).astype(np.float32).astype(np.float64),
        a.size,
        b.size,
    )


def easy_series(n: int, samples: int, seed: int) -> Series:
    """A well damped model of n parameters with random binary commands.

    Its poles have the magnitude 0.5; the noise of the equation has the deviation 0.1.
    """
    na = n // 2
    angles = np.pi * (np.arange(na // 2) + 1.0) / (na // 2 + 1.0)
    poles = 0.5 * np.concatenate((np.exp(1j * angles), np.exp(-1j * angles), np.ones(na % 2)))
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], size=samples)
    b = 1.0 / np.arange(1.0, n - na + 1.0)
    return simulated(np.real(np.poly(poles))[1:], b, u, 0.1 * rng.normal(size=samples))


def series_16(samples: int, seed: int, *, noise: float, times_faster: int = 1) -> Series:
    """Model (16) with random binary commands, or the same servo sampled faster.

    The commands hold for `times_faster` samples, so that the servo itself gets the same.
    """
    a, b = (A16, B16) if times_faster == 1 else sampled_faster(times_faster)
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], size=-(-samples // times_faster)), times_faster)[:samples]
    return simulated(a, b, u, noise * rng.normal(size=samples))


def held_series(excited: int, held: int, seed: int, noise: float = 1e-3) -> Series:
    """Model (16): random binary commands, then a command that stays at 0.5."""
    rng = np.random.default_rng(seed)
    u = np.concatenate((rng.choice([-1.0, 1.0], size=excited), np.full(held, 0.5)))
    return simulated(A16, B16, u, noise * rng.normal(size=u.size))


def sampled_faster(times: int) -> tuple[FloatArray, FloatArray]:
    """The servo of model (16) with a sampling time so many times shorter, by zero-order hold."""
    size = A16.size
    F = np.vstack((-A16, np.eye(size)[:-1]))  # controllable canonical form
    g, h = np.eye(size)[:, :1], B16[np.newaxis]
    both = np.block([[F, g], [np.zeros((1, size)), np.ones((1, 1))]])
    short = np.real(scipy.linalg.expm(scipy.linalg.logm(both) / times))
    numerator, denominator = scipy.signal.ss2tf(
        short[:size, :size], short[:size, size:], h, np.zeros((1, 1))
    )
    return denominator[1:], numerator[0, 1:]


def batch(
    phi: FloatArray, y: FloatArray, factor: float, variance0: float, *, kept: bool = False
) -> FloatArray:
    """Weighted least squares in float64, which recursive least squares equals in exact arithmetic.

    Minimises the sum of factor^(N-k) e(k)^2 plus |theta|^2 / variance0, of which the last term is
    forgotten, too, unless `kept`.
    """
    size = y.size
    weights = np.sqrt(factor ** np.arange(size - 1, -1, -1, dtype=np.float64))
    prior = np.sqrt((1.0 if kept else factor**size) / variance0)
    rows = np.vstack((prior * np.eye(phi.shape[1]), weights[:, np.newaxis] * phi))
    wanted = np.concatenate((np.zeros(phi.shape[1]), weights * y))
    found, *_ = np.linalg.lstsq(rows, wanted, rcond=None)
    return np.asarray(found)


def tolerance(phi: FloatArray, factor: float, scalar: str) -> float:
    """How far rounding may take a recursion from the truth, relative to the largest parameter.

    An update sums n products four times (phi' theta, P phi, phi' P phi, and the rounded elements
    of the new P that meet in the next sum), so its relative rounding error is about 4 n u with the
    unit roundoff u. Those of the samples in the memory, 1 / (1 - factor) or all, are independent,
    so their sum grows with the square root of their number; the condition number of the information
    matrix of these samples enlarges it.
    """
    roundoff = float(np.finfo(np.dtype("float32" if scalar == "float" else "float64")).eps) / 2.0
    memory = phi.shape[0] if factor == 1.0 else min(phi.shape[0], round(1.0 / (1.0 - factor)))
    weights = factor ** np.arange(phi.shape[0] - 1, -1, -1, dtype=np.float64)
    condition = float(np.linalg.cond((phi * weights[:, np.newaxis]).T @ phi))
    return 4.0 * phi.shape[1] * roundoff * float(np.sqrt(memory)) * condition
