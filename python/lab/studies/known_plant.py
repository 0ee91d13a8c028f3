# SPDX-License-Identifier: MIT
"""An ARX plant whose parameters are known and may change during the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter, lfiltic

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.models.identification import ArxOrders


@dataclass(frozen=True, eq=False)
class KnownPlant:
    """Difference equation (7), A(q^-1) y(k) = q^-nk B(q^-1) u(k) + e(k), constant in pieces.

    Attributes
    ----------
    orders
        structure of the model, without constant term.
    pieces
        pairs (k, theta): from sample k on the parameters are theta = (a1 .. a_na, b1 .. b_nb). The
        first piece starts at 0, the others follow in order.
    """

    orders: ArxOrders
    pieces: tuple[tuple[int, FloatArray], ...]

    @classmethod
    def of(cls, orders: ArxOrders, theta: Sequence[float]) -> KnownPlant:
        """Returns a plant whose parameters do not change."""
        return cls(orders, ((0, np.asarray(theta, dtype=np.float64)),))

    def changed(self, at: int, theta: FloatArray) -> KnownPlant:
        """Returns this plant with other parameters from sample `at` on."""
        return KnownPlant(self.orders, (*self.pieces, (at, theta)))

    def theta_path(self, n: int) -> FloatArray:
        """Returns the true parameters at each of n samples, shape (n, na + nb)."""
        starts = np.array([start for start, _ in self.pieces])
        which = np.searchsorted(starts, np.arange(n), side="right") - 1
        return np.stack([theta for _, theta in self.pieces])[which]

    def respond(self, u: FloatArray, e: FloatArray) -> FloatArray:
        """Simulates the output from rest; input u, equation error e and output have shape (N,)."""
        na, nk = self.orders.na, self.orders.nk
        y = np.zeros(u.size)
        stops = [start for start, _ in self.pieces[1:]] + [u.size]
        for (start, theta), stop in zip(self.pieces, stops, strict=True):
            moving = np.convolve(u, np.concatenate([np.zeros(nk), theta[na:]]))[start:stop]
            denominator = np.concatenate([[1.0], theta[:na]])
            # The filter starts from the past outputs, also if other parameters produced them.
            past = y[max(start - na, 0) : start][::-1]
            state = lfiltic([1.0], denominator, past)
            y[start:stop], _ = lfilter([1.0], denominator, moving + e[start:stop], zi=state)
        return y
