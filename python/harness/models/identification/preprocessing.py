# SPDX-License-Identifier: MIT
"""Pre-processing of a record before identification: outliers, means or trends, scaling."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from ...base.encoding import to_plain
from ...base.numbers import FloatArray
from .arx import ArxModel
from .data import ROUNDING, IdentificationError, IoData
from .outliers import Outliers, replace_outliers
from .residuals import Prediction

Trend = Literal["none", "mean", "linear"]

CONSEQUENCE = {
    "none": (
        "Means and trends stay in the signals; the constant term of the model takes up the "
        "working point, also where the plant integrates."
    ),
    "mean": (
        "With a constant term in the model this changes nothing: the term takes up both means. "
        "Without one, the mean of the input counts as the input at which the output rests; for a "
        "plant that integrates it is not, and the free run drifts."
    ),
    "linear": (
        "A line in the output is taken for drift, one in the input for none of the plant's "
        "business. For a plant that settles, both lines belong together and nothing is lost; for "
        "one that integrates, a line in the input bends the output, and what is left of the bend "
        "counts as disturbance. The line of the first part is drawn on through the second."
    ),
}


@dataclass(frozen=True)
class Preprocessing:
    """Settings of the pre-processing; the steps are carried out in this order."""

    trend: Trend = "none"
    """What is subtracted from input and output: nothing, the mean, or a straight line."""
    outliers: bool = True
    """Whether spikes of the output are interpolated, see `replace_outliers`."""
    scaling: bool = False
    """Whether input and output are divided by their standard deviations."""

    def __post_init__(self) -> None:
        if self.trend not in get_args(Trend):
            raise IdentificationError(
                f"trend is '{self.trend}': expected one of {', '.join(get_args(Trend))}"
            )

    def __str__(self) -> str:
        trend = {"none": "no detrending", "mean": "means removed", "linear": "lines removed"}
        return ", ".join(
            [
                trend[self.trend],
                "outliers replaced" if self.outliers else "outliers left",
                *(["scaled"] if self.scaling else []),
            ]
        )


@dataclass(frozen=True)
class SignalReport:
    """Statistics of one signal in the estimation part, and how the whole signal was transformed.

    The transformed signal is (signal(k) - level - slope k) / scale with the sample number k.
    """

    name: str
    """Name of the signal."""
    mean: float
    trend_per_sample: float
    deviation: float
    """Mean, slope of the straight line per sample, and standard deviation before the
    transformation."""
    level: float
    slope: float
    """Subtracted constant and slope per sample; 0 if nothing was subtracted."""
    scale: float
    """divisor; 1 if the signal was not scaled."""

    def forward(self, signal: FloatArray) -> FloatArray:
        """Returns the whole signal, shape (n,), transformed."""
        line = self.level + self.slope * np.arange(signal.size)
        moved = signal - line
        if np.max(np.abs(moved), initial=0.0) <= ROUNDING * abs(self.level):
            return np.zeros_like(signal)  # rounding errors must not be taken for excitation
        return moved / self.scale

    def back(self, index: npt.NDArray[np.int64], values: FloatArray) -> FloatArray:
        """Returns transformed values at the sample numbers `index` in the units of the record."""
        return self.scale * values + self.level + self.slope * index


@dataclass(frozen=True, eq=False)
class Preprocessed:
    """Pre-processed data, and the transformation back to the units of the record."""

    data: IoData
    """Pre-processed data."""
    settings: Preprocessing
    """Settings of the pre-processing."""
    u: SignalReport
    y: SignalReport
    """Transformations of input and output."""
    outliers: Outliers | None
    """Report on outliers of the output; None if the settings switch the search off."""
    consequence: str
    """Effect of the treatment of means and trends on the model, in words."""

    def restore(self, prediction: Prediction) -> Prediction:
        """Returns a prediction on `data` in the units of the record; outliers stay interpolated."""
        return replace(
            prediction,
            measured=self.y.back(prediction.index, prediction.measured),
            predicted=self.y.back(prediction.index, prediction.predicted),
        )

    def restore_model(self, model: ArxModel) -> ArxModel:
        """Returns a model of `data` in the units of the record.

        The removed means go into `u_mean` and `y_mean`. An ARX model cannot represent removed
        straight lines: if lines were removed, the result is a model of the signals without them.
        Its transfer function is still that of the record. For a free run in the units of the
        record, apply `restore` to the free run on `data`.

        Parameters
        ----------
        model
            model fitted to `data`.
        """
        # A y/s_y = B u/s_u + c + e, times s_y.
        orders = model.orders
        factor = np.concatenate(
            (
                np.ones(orders.na),
                np.full(orders.nb, self.y.scale / self.u.scale),
                np.full(int(orders.offset), self.y.scale),
            )
        )
        return replace(
            model,
            theta=factor * model.theta,
            covariance=np.outer(factor, factor) * model.covariance,
            noise_variance=self.y.scale**2 * model.noise_variance,
            loss=self.y.scale**2 * model.loss,
            u_mean=self.u.scale * model.u_mean + (0.0 if self.u.slope else self.u.level),
            y_mean=self.y.scale * model.y_mean + (0.0 if self.y.slope else self.y.level),
        )

    def to_dict(self) -> dict[str, Any]:
        """Returns plain values for JSON, without the data."""
        plain: dict[str, Any] = to_plain(self)
        del plain["data"]
        return plain


def preprocess(
    data: IoData, settings: Preprocessing | None = None, *, split: float = 0.5
) -> Preprocessed:
    """Replaces outliers of the output, subtracts means or trends, and scales the signals.

    The outlier model, means, lines and scales are estimated from the estimation part alone. One
    mean or line is used for all segments: an own mean for each segment would be estimated from the
    data that judge the model. Lines are functions of the sample number.

    Parameters
    ----------
    data
        input and output.
    settings
        `Preprocessing()` by default.
    split
        share of the samples in the estimation part, 0 < split < 1, as in `identify`.

    Raises
    ------
    IdentificationError
        the split is out of range, or the estimation part has no samples.
    """
    settings = settings or Preprocessing()
    estimation, _ = data.split(split)
    if not estimation.segments:
        raise IdentificationError("the estimation part has no samples")
    y, outliers = replace_outliers(data, estimation) if settings.outliers else (data.y, None)
    k = estimation.index
    reports = [
        _report(name, signal, k, settings)
        for name, signal in ((data.input_name, data.u), (data.output_name, y))
    ]
    ready = replace(data, u=reports[0].forward(data.u), y=reports[1].forward(y))
    return Preprocessed(
        ready, settings, reports[0], reports[1], outliers, CONSEQUENCE[settings.trend]
    )


def _report(
    name: str, signal: FloatArray, k: npt.NDArray[np.int64], settings: Preprocessing
) -> SignalReport:
    part = signal[k]
    mean, centre = float(np.mean(part)), float(np.mean(k))
    # Least squares with centred k: slope = sum (k - k_mean) x / sum (k - k_mean)^2.
    spread = float(np.sum((k - centre) ** 2))
    trend = float(np.sum((k - centre) * (part - mean)) / spread) if spread > 0.0 else 0.0
    slope = trend if settings.trend == "linear" else 0.0
    level = 0.0 if settings.trend == "none" else mean - slope * centre
    moving = float(np.std(part - level - slope * k))
    flat = moving <= ROUNDING * float(np.max(np.abs(part)))
    scale = moving if settings.scaling and not flat else 1.0
    return SignalReport(name, mean, trend, float(np.std(part)), level, slope, scale)
