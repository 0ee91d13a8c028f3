# SPDX-License-Identifier: MIT
"""A third-order ARX plant whose parameters are known and may change on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter, lfiltic

from ehsid.harness.arrays import FloatArray
from ehsid.harness.identification import ArxOrders


@dataclass(frozen=True, eq=False)
class KnownPlant:
    """Difference equation (7), A(q^-1) y(k) = q^-nk B(q^-1) u(k) + e(k), in pieces.

    Attributes
    ----------
    orders
        structure, without offset.
    pieces
        (k, theta): from sample k on the parameters are theta = (a1 .. a_na, b1 .. b_nb). The first
        piece starts at 0, the others follow in order.
    """

    orders: ArxOrders
    pieces: tuple[tuple[int, FloatArray], ...]

    @classmethod
    def of(cls, orders: ArxOrders, theta: Sequence[float]) -> KnownPlant:
        """A plant that does not change."""
        return cls(orders, ((0, np.asarray(theta, dtype=np.float64)),))

    def changed(self, at: int, theta: FloatArray) -> KnownPlant:
        """The same plant until sample `at`, with other parameters from there on."""
        return KnownPlant(self.orders, (*self.pieces, (at, theta)))

    def theta_path(self, n: int) -> FloatArray:
        """The true parameters at each of n samples, shape (n, na + nb)."""
        starts = np.array([start for start, _ in self.pieces])
        which = np.searchsorted(starts, np.arange(n), side="right") - 1
        return np.stack([theta for _, theta in self.pieces])[which]

    def respond(self, u: FloatArray, e: FloatArray) -> FloatArray:
        """Output to input u and equation error e, both of shape (N,), from rest. Shape (N,)."""
        na, nk = self.orders.na, self.orders.nk
        y = np.zeros(u.size)
        stops = [start for start, _ in self.pieces[1:]] + [u.size]
        for (start, theta), stop in zip(self.pieces, stops, strict=True):
            moving = np.convolve(u, np.concatenate([np.zeros(nk), theta[na:]]))[start:stop]
            denominator = np.concatenate([[1.0], theta[:na]])
            # The past outputs are those that were there, whatever parameters made them.
            past = y[max(start - na, 0) : start][::-1]
            state = lfiltic([1.0], denominator, past)
            y[start:stop], _ = lfilter([1.0], denominator, moving + e[start:stop], zi=state)
        return y
