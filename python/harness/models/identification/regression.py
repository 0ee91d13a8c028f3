# SPDX-License-Identifier: MIT
"""Regression matrix of an ARX model, and its least-squares solution by QR."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg

from ...base.arrays import FloatArray
from .data import IoData
from .errors import IdentificationError, TooFewSamplesError, UnexcitedError
from .orders import ArxOrders

# A parameter belongs to an undetermined combination if its share in the combination is at least
# this fraction of the largest share. Rounding errors give shares of the order of 1e-12 to other
# parameters, so any small number well above that serves.
SHARE_THAT_COUNTS = 1e-3


@dataclass(frozen=True, eq=False)
class Regression:
    """Rows of Eq. (8), y(k) = phi(k)' theta + e(k), for all k whose past samples are available.

    Attributes
    ----------
    phi
        shape (n_rows, n_parameters), regression matrix.
    y
        shape (n_rows,), output y(k).
    index
        shape (n_rows,), sample number k of each row.
    runs
        slices of rows with consecutive k.
    """

    phi: FloatArray
    y: FloatArray
    index: npt.NDArray[np.int64]
    runs: tuple[slice, ...]


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
