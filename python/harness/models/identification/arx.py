# SPDX-License-Identifier: MIT
"""Estimates an ARX model offline by least squares, Ghazali et al. 2011, Eqs. (7)-(11).

Regression matrix of an ARX model, and its least-squares solution by QR.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.stats

from ...base.encoding import to_plain
from ...base.numbers import FloatArray
from .data import ArxOrders, IdentificationError, IoData, TooFewSamplesError, UnexcitedError

# A parameter belongs to an undetermined combination if its share in the combination is at least
# this fraction of the largest share. Rounding errors give shares of the order of 1e-12 to other
# parameters, so any small number well above that serves.
SHARE_THAT_COUNTS = 1e-3


@dataclass(frozen=True, eq=False)
class Regression:
    """Rows of Eq. (8), y(k) = phi(k)' theta + e(k), for all k whose past samples are available."""

    phi: FloatArray
    """Shape (n_rows, n_parameters), regression matrix."""
    y: FloatArray
    """Shape (n_rows,), output y(k)."""
    index: npt.NDArray[np.int64]
    """Shape (n_rows,), sample number k of each row."""
    runs: tuple[slice, ...]
    """Slices of rows with consecutive k."""


def regression(data: IoData, orders: ArxOrders, *, skip: int | None = None) -> Regression:
    """Returns the regression with phi = (-y(k-1)..-y(k-na), u(k-nk)..u(k-nk-nb+1)[, 1]).

    Parameters
    ----------
    data
        input and output; a segment that is too short to give a row is left out.
    orders
        structure of the model.
    skip
        number of samples left out at the start of each segment, at least `orders.n_history` (the
        default). With a common number, different orders can be compared row by row.

    Raises
    ------
    IdentificationError
        `skip` is shorter than the history.
    TooFewSamplesError
        no segment gives a row.
    """
    skip = orders.n_history if skip is None else skip
    if skip < orders.n_history:
        raise IdentificationError(f"{orders} needs {orders.n_history} samples before, not {skip}")
    pieces = [
        np.arange(segment.start + skip, segment.stop)
        for segment in data.segments
        if segment.stop - segment.start > skip
    ]
    if not pieces:
        raise TooFewSamplesError(
            f"{orders} needs a segment of more than {skip} samples; the longest has "
            f"{max((s.stop - s.start for s in data.segments), default=0)}"
        )
    k = np.concatenate(pieces)
    phi = np.empty((k.size, orders.n_parameters))
    for i in range(orders.na):
        phi[:, i] = -data.y[k - 1 - i]
    for i in range(orders.nb):
        phi[:, orders.na + i] = data.u[k - orders.nk - i]
    if orders.offset:
        phi[:, -1] = 1.0
    ends = np.cumsum([piece.size for piece in pieces])
    runs = tuple(slice(int(end) - p.size, int(end)) for p, end in zip(pieces, ends, strict=True))
    return Regression(phi, data.y[k], k, runs)


def least_squares(
    phi: FloatArray, y: FloatArray, names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Returns the theta that minimises |y - phi theta|^2, Eqs. (9)-(11), and (phi' phi)^-1.

    The solution uses QR of the matrix with columns scaled to unit length and not the normal
    equations, so that neither the units nor similar columns of close lags reduce the accuracy.

    Parameters
    ----------
    phi
        regression matrix, shape (n, d), n >= d.
    y
        output, shape (n,).
    names
        names of the d parameters, for the message.

    Raises
    ------
    TooFewSamplesError
        there are fewer rows than parameters.
    UnexcitedError
        phi does not have full rank, to within rounding errors.
    """
    n, d = phi.shape
    if n < d:
        raise TooFewSamplesError(
            f"{n} equations do not determine {d} parameters: expected at least {d}; record longer, "
            "or take lower orders"
        )
    scale = np.linalg.norm(phi, axis=0)
    if (scale == 0.0).any():
        flat = tuple(name for name, s in zip(names, scale, strict=True) if s == 0.0)
        raise UnexcitedError(flat, "the signals they multiply are zero throughout")
    (r,) = scipy.linalg.qr(np.column_stack((phi / scale, y)), mode="r")
    r_phi, r_y = r[:d, :d], r[:d, d]
    _, singular, right = np.linalg.svd(r_phi)
    # numpy's matrix_rank uses the same bound for the rounding errors of the factorisation.
    rank = int(np.sum(singular > singular[0] * n * np.finfo(np.float64).eps))
    if rank < d:
        raise _rank_deficient(right[rank:], names)
    theta = scipy.linalg.solve_triangular(r_phi, r_y) / scale
    r_inverse = scipy.linalg.solve_triangular(r_phi, np.eye(d)) / scale[:, np.newaxis]
    return theta, r_inverse @ r_inverse.T


def _rank_deficient(null_space: FloatArray, names: tuple[str, ...]) -> UnexcitedError:
    share = np.linalg.norm(null_space, axis=0)
    involved = tuple(
        name
        for name, part in zip(names, share, strict=True)
        if part >= SHARE_THAT_COUNTS * np.max(share)
    )
    if any(name.startswith("a") for name in involved):
        why = (
            "their regressors depend on each other; the order is too high for data without noise, "
            "or a signal is constant, or the input is a fixed combination of past outputs"
        )
    else:
        why = (
            "the input is constant or has too few frequencies; it needs at least nb / 2 of them, "
            "or steps at irregular times"
        )
    return UnexcitedError(involved, why)


@dataclass(frozen=True, eq=False)
class ArxModel:
    """An estimated ARX model."""

    orders: ArxOrders
    """Structure of the model."""
    theta: FloatArray
    """Shape (d,), estimated parameters (a1..a_na, b1..b_nb[, offset])."""
    covariance: FloatArray
    """Shape (d, d), noise_variance (phi' phi)^-1; it describes the scatter of theta if the
    residuals are white (Ljung, System Identification, 2nd ed. 1999, ch. 9)."""
    noise_variance: float
    """Sum of squared residuals / (n_rows - d); NaN if n_rows = d."""
    loss: float
    """Sum of squared residuals / n_rows."""
    n_rows: int
    """Number of equations used."""
    u_mean: float = 0.0
    y_mean: float = 0.0
    """Means subtracted from input and output before the estimation; 0 if none were subtracted."""

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
