# SPDX-License-Identifier: MIT
"""Estimates an ARX model offline by least squares, Ghazali et al. 2011, Eqs. (7)-(11)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.stats

from ...base.arrays import FloatArray
from ...base.encoding import to_plain
from .data import IoData
from .orders import ArxOrders
from .regression import least_squares, regression


@dataclass(frozen=True, eq=False)
class ArxModel:
    """An estimated ARX model.

    Attributes
    ----------
    orders
        structure of the model.
    theta
        shape (d,), estimated parameters (a1..a_na, b1..b_nb[, offset]).
    covariance
        shape (d, d), noise_variance (phi' phi)^-1; it describes the scatter of theta if the
        residuals are white (Ljung, System Identification, 2nd ed. 1999, ch. 9).
    noise_variance
        sum of squared residuals / (n_rows - d); NaN if n_rows = d.
    loss
        sum of squared residuals / n_rows.
    n_rows
        number of equations used.
    u_mean, y_mean
        means subtracted from input and output before the estimation; 0 if none were subtracted.
    """

    orders: ArxOrders
    theta: FloatArray
    covariance: FloatArray
    noise_variance: float
    loss: float
    n_rows: int
    u_mean: float = 0.0
    y_mean: float = 0.0

    @property
    def a(self) -> FloatArray:
        """Output coefficients a1..a_na, shape (na,)."""
        return self.theta[: self.orders.na]

    @property
    def b(self) -> FloatArray:
        """Input coefficients b1..b_nb, shape (nb,)."""
        return self.theta[self.orders.na : self.orders.na + self.orders.nb]

    @property
    def offset(self) -> float:
        """Constant term; 0 if the model has none."""
        return float(self.theta[-1]) if self.orders.offset else 0.0

    @property
    def standard_deviations(self) -> FloatArray:
        """Standard deviations of theta, shape (d,): roots of the diagonal of the covariance."""
        return np.sqrt(np.diag(self.covariance))

    def intervals(self, level: float = 0.95) -> FloatArray:
        """Returns confidence intervals of theta, shape (d, 2), from the normal limit distribution.

        Parameters
        ----------
        level
            confidence level, 0 < level < 1.
        """
        half = float(scipy.stats.norm.ppf(0.5 + 0.5 * level)) * self.standard_deviations
        return np.column_stack((self.theta - half, self.theta + half))

    def centre(self, data: IoData) -> IoData:
        """Returns the data minus the means that were subtracted in the estimation."""
        return replace(data, u=data.u - self.u_mean, y=data.y - self.y_mean)

    def to_dict(self) -> dict[str, Any]:
        """Returns plain values for JSON, with parameter names and standard deviations."""
        return {
            **to_plain(self),
            "names": list(self.orders.names),
            "standard_deviations": to_plain(self.standard_deviations),
        }


def fit_arx(
    data: IoData, orders: ArxOrders, *, remove_means: bool = False, skip: int | None = None
) -> ArxModel:
    """Estimates an ARX model by least squares over all segments.

    Parameters
    ----------
    data
        input and output.
    orders
        structure of the model.
    remove_means
        whether the means of input and output over the segments are subtracted first.
    skip
        samples left out at the start of each segment, see `regression`.

    Raises
    ------
    TooFewSamplesError
        there are fewer equations than parameters.
    UnexcitedError
        the data do not determine all parameters.
    """
    u_mean, y_mean = (
        (float(np.mean(signal[data.index])) if remove_means else 0.0) for signal in (data.u, data.y)
    )
    rows = regression(
        replace(data, u=_less(data.u, u_mean), y=_less(data.y, y_mean)), orders, skip=skip
    )
    theta, inverse = least_squares(rows.phi, rows.y, orders.names)
    squares = float(np.sum((rows.y - rows.phi @ theta) ** 2))
    n, d = rows.phi.shape
    noise_variance = squares / (n - d) if n > d else float("nan")
    return ArxModel(
        orders, theta, noise_variance * inverse, noise_variance, squares / n, n, u_mean, y_mean
    )


def _less(signal: FloatArray, mean: float) -> FloatArray:
    centred = signal - mean
    # A constant signal minus its mean leaves rounding errors, which must not count as excitation.
    if np.max(np.abs(centred)) <= 8.0 * np.finfo(np.float64).eps * abs(mean):
        return np.zeros_like(signal)
    return centred
