# SPDX-License-Identifier: MIT
"""What is drawn of an identified model, as numbers: matplotlib and Bokeh only draw it."""

from __future__ import annotations

import msgspec
import numpy as np
import numpy.typing as npt

from ..models.identification import (
    EstimatedResponse,
    FrequencyResponse,
    IdentificationResult,
    IoData,
    frequency_response,
    power_band,
    response_grid,
)
from ..models.identification.residuals import IndependenceTest, WhitenessTest

FARTHEST = 1e4  # of the end of a band, in dB or degrees


class Curve(msgspec.Struct, frozen=True):
    """A curve over the frequency, with the ends of its 95 % band, and those of its axis.

    `known` are values that are known otherwise, at `Bode.known_at`.
    """

    label: str
    middle: list[float]
    low: list[float]
    high: list[float]
    ends: tuple[float, float]
    known: list[float] = []


class Bode(msgspec.Struct, frozen=True):
    """A Bode diagram; the frequency is in Hz, or per sample without a sampling time.

    Attributes
    ----------
    frequency
        of the curves.
    curves
        magnitude in dB, and phase in degrees.
    not_excited
        stretches of the frequency in which the input has next to no power.
    known_at, source
        frequencies at which the response is known otherwise, and from where; empty where it is not.
    """

    frequency: list[float]
    curves: list[Curve]
    not_excited: list[tuple[float, float]]
    known_at: list[float] = []
    source: str = ""


class Lags(msgspec.Struct, frozen=True):
    """A residual test: the correlation at each lag in samples, and the 99 % band of one lag."""

    lags: list[int]
    values: list[float]
    band: float

    @property
    def outside(self) -> npt.NDArray[np.bool_]:
        """Which lags are outside of the band."""
        return np.asarray(np.abs(self.values) > self.band)


def lags(test: WhitenessTest | IndependenceTest) -> Lags:
    """Returns what is drawn of a residual test."""
    return Lags(test.lags.tolist(), test.correlation.tolist(), test.band)


def model_bode(result: IdentificationResult, data: IoData) -> Bode:
    """Returns the diagram of a model that was identified from these data."""
    dt_s = data.dt_s or 1.0
    grid = response_grid(result.n_validation, dt_s)
    return bode(frequency_response(result.chosen.model, grid, dt_s), power_band(data))


def bode(
    response: EstimatedResponse,
    input_band: tuple[float, float] | None = None,
    truth: FrequencyResponse | None = None,
) -> Bode:
    """Returns the diagram of a model; grey is outside of `input_band`, and `truth` is known."""
    f = response.frequency_hz
    magnitude = phase = np.zeros(0)
    if truth is not None:
        # The two phases are unwrapped separately, so they can differ by multiples of 360 degrees.
        nearest = int(np.argmin(np.abs(f - truth.frequency_hz[0])))
        turns = np.round((response.phase_deg[nearest] - truth.phase_deg[0]) / 360.0)
        magnitude, phase = truth.magnitude_db, truth.phase_deg + 360.0 * turns
    curves = []
    for label, middle, band, known, margin in (
        ("magnitude in dB", response.magnitude_db, response.magnitude_band_db(), magnitude, 6.0),
        ("phase in degrees", response.phase_deg, response.phase_band_deg(), phase, 60.0),
    ):
        # A band is very wide where the data hardly determine the model, and may be infinite; it
        # must not flatten the curve.
        low, high = np.nan_to_num(band.T, nan=0.0, posinf=FARTHEST, neginf=-FARTHEST).tolist()
        seen = np.concatenate((middle, known))
        ends = float(np.min(seen)) - margin, float(np.max(seen)) + margin
        curves.append(Curve(label, middle.tolist(), low, high, ends, known.tolist()))
    spans = [] if input_band is None else [(f[0], input_band[0]), (input_band[1], f[-1])]
    return Bode(
        f.tolist(),
        curves,
        [(float(start), float(stop)) for start, stop in spans if start < stop],
        [] if truth is None else truth.frequency_hz.tolist(),
        "" if truth is None else truth.source,
    )
