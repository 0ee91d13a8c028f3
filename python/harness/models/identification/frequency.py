# SPDX-License-Identifier: MIT
"""Frequency response of an ARX model with its confidence band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.signal
import scipy.stats

from ...base.numbers import FloatArray
from .arx import ArxModel
from .data import IdentificationError, IoData

ComplexArray = npt.NDArray[np.complex128]

POWER_SHARE = 0.99

# Number of frequencies at which a response is drawn, and the highest of them as a share of the
# sampling rate. It is just below half the sampling rate, where the phase of a sampled system jumps.
N_FREQUENCIES = 200
HIGHEST_SHARE = 0.499


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Frequency response G(e^jw) of a sampled system."""

    frequency_hz: FloatArray
    """Shape (n,), increasing, above 0 and below half the sampling rate."""
    response: ComplexArray
    """Shape (n,), complex ratio of output to input."""
    source: str
    """Origin of the response, in words."""

    @property
    def magnitude_db(self) -> FloatArray:
        """Magnitude 20 log10 |G| in dB, shape (n,)."""
        return np.asarray(20.0 * np.log10(np.abs(self.response)), dtype=np.float64)

    @property
    def phase_deg(self) -> FloatArray:
        """Unwrapped phase in degrees, without jumps between frequencies, shape (n,)."""
        return np.asarray(np.degrees(np.unwrap(np.angle(self.response))), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class EstimatedResponse(FrequencyResponse):
    """Frequency response of an estimated model."""

    covariance: FloatArray
    """Shape (n, 2, 2), covariance of real and imaginary part of G at each frequency."""

    def magnitude_band_db(self, level: float = 0.95) -> FloatArray:
        """Pointwise confidence interval of the magnitude in dB, shape (n, 2)."""
        half = 20.0 / np.log(10.0) * _half(level) * self._relative()[:, 0]
        return np.column_stack((self.magnitude_db - half, self.magnitude_db + half))

    def phase_band_deg(self, level: float = 0.95) -> FloatArray:
        """Pointwise confidence interval of the phase in degrees, shape (n, 2)."""
        half = np.degrees(_half(level) * self._relative()[:, 1])
        return np.column_stack((self.phase_deg - half, self.phase_deg + half))

    def _relative(self) -> FloatArray:
        """Standard deviations of ln |G| and of the phase in rad, shape (n, 2).

        d ln G = dG / G: the real part is the change of ln |G|, the imaginary part the change of
        the phase. This is a first-order approximation, valid for deviations well below |G|.
        """
        inverse = 1.0 / self.response
        turn = np.array([[inverse.real, -inverse.imag], [inverse.imag, inverse.real]])
        turn = turn.transpose(2, 0, 1)
        spread = turn @ self.covariance @ turn.transpose(0, 2, 1)
        variance = np.stack((spread[:, 0, 0], spread[:, 1, 1]), axis=1)
        return np.asarray(np.sqrt(variance), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Agreement:
    """Comparison of a model's frequency response with a response taken as the truth."""

    frequency_hz: FloatArray
    """Shape (n,), frequencies of the true response."""
    magnitude_difference_db: FloatArray
    phase_difference_deg: FloatArray
    """Shape (n,), model minus truth; the phase difference lies between -180 and 180 degrees."""
    inside: npt.NDArray[np.bool_]
    """Shape (n,), whether the truth is inside the 95 % confidence ellipse of the model at this
    frequency."""

    def within(self, band_hz: tuple[float, float]) -> Agreement:
        """Returns the comparison at the frequencies inside a band, its ends included."""
        kept = (self.frequency_hz >= band_hz[0]) & (self.frequency_hz <= band_hz[1])
        return Agreement(
            self.frequency_hz[kept],
            self.magnitude_difference_db[kept],
            self.phase_difference_deg[kept],
            self.inside[kept],
        )


def power_band(data: IoData) -> tuple[float, float]:
    """Returns the lowest and highest frequency of the band that holds most of the input's power.

    The input is not constant. The power is that of the periodogram of the longest segment in which
    the input changes, with its mean removed. Half of the remaining power lies below the band and
    half above. Frequencies are in Hz, or in cycles per sample if the sampling time is not known.
    """
    moving = [segment for segment in data.segments if np.ptp(data.u[segment]) > 0.0]
    longest = max(moving, key=lambda segment: segment.stop - segment.start)
    frequency, power = scipy.signal.periodogram(data.u[longest], fs=1.0 / (data.dt_s or 1.0))
    below = np.cumsum(power) / np.sum(power)
    first, last = np.searchsorted(below, (0.5 - 0.5 * POWER_SHARE, 0.5 + 0.5 * POWER_SHARE))
    return float(frequency[first]), float(frequency[last])


def response_grid(n_samples: int, dt_s: float) -> FloatArray:
    """Returns frequencies in Hz, from one period per record to nearly half the sampling rate.

    Parameters
    ----------
    n_samples
        length of the record in samples, at least 3.
    dt_s
        sampling time in seconds.

    Returns
    -------
    Shape (200,), with logarithmic spacing.
    """
    return np.geomspace(1.0 / (n_samples * dt_s), HIGHEST_SHARE / dt_s, N_FREQUENCIES)


def frequency_response(
    model: ArxModel, frequency_hz: npt.ArrayLike, dt_s: float
) -> EstimatedResponse:
    """Returns G = z^-nk B(z^-1) / A(z^-1) at z = e^(j w dt), with its delta-method covariance.

    Parameters
    ----------
    model
        estimated model.
    frequency_hz
        shape (n,), increasing, 0 < f < 1 / (2 dt_s).
    dt_s
        sampling time in seconds.

    Raises
    ------
    IdentificationError
        a frequency is outside the range, or the frequencies do not increase.
    """
    f = np.asarray(frequency_hz, dtype=np.float64)
    if f.ndim != 1 or not ((f > 0.0) & (f < 0.5 / dt_s)).all() or (np.diff(f) <= 0.0).any():
        raise IdentificationError(
            f"frequencies must rise, above 0 and below half the sampling rate, {0.5 / dt_s:g} Hz"
        )
    na, nb, nk = model.orders.na, model.orders.nb, model.orders.nk
    back = np.exp(-2j * np.pi * f * dt_s)  # z^-1
    of_a = back[:, None] ** np.arange(1, na + 1)
    of_b = back[:, None] ** np.arange(nk, nk + nb)
    denominator = 1.0 + of_a @ model.a
    g = np.asarray((of_b @ model.b) / denominator, dtype=np.complex128)
    # dG/db_i = z^-(nk+i-1) / A, dG/da_i = -G z^-i / A.
    gradient = np.concatenate((-g[:, None] * of_a, of_b), axis=1) / denominator[:, None]
    jacobian = np.stack((gradient.real, gradient.imag), axis=1)
    cov = model.covariance[: na + nb, : na + nb]
    return EstimatedResponse(
        f, g, f"model {model.orders}", jacobian @ cov @ jacobian.transpose(0, 2, 1)
    )


def agreement(model: ArxModel, truth: FrequencyResponse, dt_s: float) -> Agreement:
    """Compares a model with a frequency response, at the frequencies of that response.

    Parameters
    ----------
    model
        estimated model, in the units of `truth`.
    truth
        response taken as the truth.
    dt_s
        sampling time in seconds.
    """
    ours = frequency_response(model, truth.frequency_hz, dt_s)
    difference = truth.response - ours.response
    parts = np.column_stack((difference.real, difference.imag))
    # The pseudo-inverse is used because the ellipse of a low-order model can shrink to a line.
    inverse = np.linalg.pinv(ours.covariance, hermitian=True)
    distance = np.einsum("ni,nij,nj->n", parts, inverse, parts)
    return Agreement(
        truth.frequency_hz,
        ours.magnitude_db - truth.magnitude_db,
        np.asarray(np.degrees(np.angle(ours.response / truth.response)), dtype=np.float64),
        distance <= float(scipy.stats.chi2.ppf(0.95, 2)),
    )


def _half(level: float) -> float:
    return float(scipy.stats.norm.ppf(0.5 + 0.5 * level))
