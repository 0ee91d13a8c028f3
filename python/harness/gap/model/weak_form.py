# SPDX-License-Identifier: MIT
"""Weak form of differential equations: test functions replace derivatives of measured signals.

An equation also holds as a mean with any smooth weight psi of compact support. Integration by parts

    int psi f' dt = -int psi' f dt,    int psi f'' dt = int psi'' f dt,

leaves only derivatives of psi: H. A. Preisig, D. W. T. Rippin, Theory and application of the
modulating function method, Comput. Chem. Eng. 17(1), 1993; D. A. Messenger, D. M. Bortz, Weak
SINDy, Multiscale Model. Simul. 19(3), 2021. The test function of the latter is used here,
psi = (1 - s^2)^p, s in [-1, 1].
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial import Polynomial
from scipy.optimize import lsq_linear

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.thresholds import WEAK_FORM_ORDER, WEAK_FORM_S, WEAK_FORM_SAMPLES


class WeakForm:
    """Test functions along a record; each overlaps the next by half and has the integral one.

    Parameters
    ----------
    dt_s
        sampling time, s.
    first
        sample at which the first test function begins.
    length
        length of the support in samples, an even number; by default that of WEAK_FORM_S, but at
        least WEAK_FORM_SAMPLES.

    Attributes
    ----------
    stride
        samples from the start of one test function to the start of the next.
    """

    def __init__(self, dt_s: float, *, first: int = 0, length: int | None = None) -> None:
        if length is None:
            length = max(WEAK_FORM_SAMPLES, 2 * round(0.5 * WEAK_FORM_S / dt_s))
        self.length = length
        self.stride = max(1, length // 2)
        self._first = first
        s = np.linspace(-1.0, 1.0, length + 1)
        time_s = 0.5 * length * dt_s * s
        bump = Polynomial([1.0, 0.0, -1.0]) ** WEAK_FORM_ORDER
        # The trapezoidal rule is made exact for parabolas: t has the slope one, t^2 / 2 the
        # curvature one, a constant neither. For psi' symmetry ensures this, psi'' is corrected.
        self._weights: list[FloatArray] = []
        for order, moment in enumerate((np.ones(s.size), time_s, 0.5 * time_s**2)):
            weights = bump.deriv(order)(s) if order else bump(s)
            if order == 2:
                weights = weights - weights.sum() * self._weights[0]
            self._weights.append(weights / float(weights @ moment))

    def mean(self, signal: FloatArray) -> FloatArray:
        """Int psi f dt for each test function; the shape changes from (N,) to (K,)."""
        return self._integral(signal, 0)

    def slope(self, signal: FloatArray) -> FloatArray:
        """Int psi f' dt for each test function, in units of the signal per second, shape (K,)."""
        return self._integral(signal, 1)

    def curvature(self, signal: FloatArray) -> FloatArray:
        """Int psi f'' dt for each test function, in units of the signal per s^2, shape (K,)."""
        return self._integral(signal, 2)

    def centres(self, samples: int) -> npt.NDArray[np.int64]:
        """Index of the sample in the middle of each test function, shape (K,)."""
        last = samples - self.length - self._first
        return self._first + self.length // 2 + np.arange(0, max(0, last), self.stride)

    def _integral(self, signal: FloatArray, order: int) -> FloatArray:
        if signal.size <= self._first + self.length:
            return np.empty(0)
        windows = sliding_window_view(signal[self._first :], self.length + 1)
        return np.asarray(windows[:: self.stride] @ self._weights[order], dtype=np.float64)


def regress(
    rows: FloatArray,
    columns: FloatArray,
    centre: FloatArray,
    weight: FloatArray,
    reach: FloatArray | None = None,
) -> FloatArray:
    """Solves the least squares min |rows + columns c|^2 + sum weight (c - centre)^2 with priors.

    Parameters
    ----------
    rows
        residuals, shape (K,).
    columns
        regressors, shape (K, n); they may have any scale and may be linearly dependent.
    centre, weight
        mean and weight of the prior of c, shape (n,); the weight is zero without a prior.
    reach
        shape (n,), > 0: c stays within centre +- reach; by default without bounds.

    Returns
    -------
    c
        estimated coefficients, shape (n,).
    """
    scale = np.sqrt(np.sum(columns**2, axis=0) + weight)
    scale[scale == 0.0] = 1.0
    # QR gives a square root of the normal equations. It has as many rows as unknowns for any K.
    stacked = np.vstack([columns, np.diag(np.sqrt(weight))]) / scale
    right = np.concatenate([-(rows + columns @ centre), np.zeros(centre.size)])
    q, r = np.linalg.qr(stacked)
    bound = np.full(centre.size, np.inf) if reach is None else reach * scale
    solution = lsq_linear(r, q.T @ right, bounds=(-bound, bound), method="bvls").x
    return np.asarray(centre + solution / scale, dtype=np.float64)
