# SPDX-License-Identifier: MIT
"""Likelihood of the errors of one output: sensor noise plus a coloured disturbance.

The error in a window is noise of the sensor, with the power N_b in octave b, white or that of
rounding to a coarse grid, whichever is larger there, plus a stationary
disturbance, whose spectrum is constant in each octave and otherwise unknown. The variance s_b^2 of
the disturbance in band b has a prior about (tolerance^2 M_b), with M_b the power of the measured
signal in the band: no simulator is exact to less than this share of the motion. A small share L of
all motion is tolerated in each band as well. With P_b the mean square of the n_b independent
coefficients of the band, the variance of each candidate's own errors follows from the maximum of
the likelihood, and

    J = sum_b (n_b / 2) ln(P_b + N_b + tolerance^2 M_b + L)

is its negative logarithm, up to a constant. An error in one octave, such as a slow drift, therefore
hides nothing in the others, and no output or band needs a weight by hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.numbers import FloatArray
from .spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class OutputLikelihood:
    """Likelihood of the coefficients of the errors of an output."""

    spectrum: Spectrum
    """Bands of the coefficients."""
    counts: FloatArray
    """Number n_b of independent coefficients in each band, shape (BANDS,)."""
    tolerated: FloatArray
    """Power floor^2 + tolerance^2 M_b of errors that are no gap, shape (BANDS,), > 0."""
    white: bool = False
    """True if the disturbance has the same variance in all bands. The largest errors then decide,
    which leads a fit from far away to the neighbourhood of its minimum."""

    def cost(self, coefficients: FloatArray) -> float:
        """Negative log-likelihood of coefficients (R,), nats; infinite if they are not finite."""
        powers = self.spectrum.powers(coefficients)
        if not np.isfinite(powers).all():
            return np.inf
        return self.cost_of(powers)

    def cost_of(self, powers: FloatArray) -> float:
        """Negative log-likelihood, nats, from the power in each band, shape (BANDS,)."""
        if self.white:
            return float(0.5 * self.counts.sum() * np.log(self._mean(powers + self.tolerated)))
        return float(0.5 * np.sum(self.counts * np.log(powers + self.tolerated)))

    def weights(self, coefficients: FloatArray) -> FloatArray:
        """Weight of the squares in each band, shape (BANDS,): dJ/dc = weight c."""
        errors = self.spectrum.powers(coefficients) + self.tolerated
        if self.white:
            scale = self.counts.sum() / self.spectrum.sizes.sum()
            return np.full(errors.size, scale / self._mean(errors))
        # d/dc (n / 2) ln(P + t) = n / (R_b (P + t)) c, with R_b coefficients in the band
        scale = self.counts / np.maximum(self.spectrum.sizes, 1.0)
        return np.asarray(scale / errors, dtype=np.float64)

    def _mean(self, by_band: FloatArray) -> float:
        """Mean over all coefficients of a number of each band, shape (BANDS,)."""
        return float(by_band @ self.spectrum.sizes / self.spectrum.sizes.sum())
