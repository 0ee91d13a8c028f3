# SPDX-License-Identifier: MIT
"""Signals and their derivatives, all smoothed by one kernel, so that equations between them hold.

A linear equation such as m y'' + b y' = F holds just as well between signals that are smoothed by
the same kernel phi. The derivatives of the smoothed position are those of the kernel,
(phi * y)' = phi' * y, so that no measured signal is differentiated (M. Shinbrot, Trans. ASME 79,
1957).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import fftconvolve

from ..base.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Kernel:
    """A smooth kernel of unit area, and its derivatives; each of shape (n,), n odd.

    Attributes
    ----------
    phi, first, second
        kernel, 1; its first derivative, 1/s; its second one, 1/s^2. Each includes the time step,
        so that a convolution needs no further factor.
    """

    phi: FloatArray
    first: FloatArray
    second: FloatArray

    def smooth(self, signal: FloatArray, order: int = 0) -> FloatArray:
        """Returns the smoothed signal or its derivative, where the whole kernel lies in it.

        Parameters
        ----------
        signal
            shape (N,), N not below the length n of the kernel.
        order
            of the derivative: 0, 1 or 2.

        Returns
        -------
        Shape (N - n + 1,).
        """
        weights = (self.phi, self.first, self.second)[order]
        # The mean is no motion. Without it, rounding of a large offset does not matter.
        mean = float(signal.mean())
        smoothed = fftconvolve(signal - mean, weights, mode="valid")
        return np.asarray(smoothed + (mean if order == 0 else 0.0), dtype=np.float64)

    @property
    def half(self) -> int:
        """Number of samples by which each side of a smoothed signal is shorter."""
        return int(self.phi.size // 2)


def kernel(duration_s: float, dt_s: float) -> Kernel:
    """Returns the kernel cos^4 of this duration, of at least seven samples.

    Its weights are exact for parabolas: the first derivative of t is 1, the second of t^2 / 2 too.
    """
    half = max(3, round(0.5 * duration_s / dt_s))
    steps = np.arange(-half, half + 1, dtype=np.float64)
    x = np.pi * steps / (2.0 * (half + 1))
    slope = np.pi / (2.0 * (half + 1) * dt_s)
    phi = np.cos(x) ** 4
    first = -4.0 * np.cos(x) ** 3 * np.sin(x) * slope
    second = slope**2 * (12.0 * np.cos(x) ** 2 * np.sin(x) ** 2 - 4.0 * np.cos(x) ** 4)
    times = steps * dt_s
    phi = phi / phi.sum()
    # Sum of w(tau) y(t - tau) for y = t is minus the sum of w(tau) tau.
    first = first / -np.sum(first * times)
    second = second - second.mean()
    second = second / np.sum(second * 0.5 * times**2)
    return Kernel(phi, first, second)
