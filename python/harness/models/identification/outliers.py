# SPDX-License-Identifier: MIT
"""Finds spikes in the measured output, distinguishes them from process events, interpolates them.

A spike d at sample k of the output (additive outlier) leaves d (1, a1, .., a_na) in the residuals
of an ARX model from sample k on. A disturbance of the process (innovational outlier) leaves one
large residual only. Sources: A. J. Fox, "Outliers in time series", J. R. Stat. Soc. B 34(3), 1972;
I. Chang, G. C. Tiao, C. Chen, "Estimation of time series parameters in the presence of outliers",
Technometrics 30(2), 1988. The scale of the residuals is Hampel's, 1.4826 median |e - median e|
(F. R. Hampel, "The influence curve and its role in robust estimation", J. Am. Stat. Assoc. 69,
1974).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.signal
import scipy.stats

from ...base.numbers import FloatArray
from .arx import ArxModel, fit_arx
from .data import ROUNDING, ArxOrders, IoData, TooFewSamplesError, UnexcitedError
from .residuals import predict_one_step

# Probability that at least one sample of a record without spikes is replaced. The residuals of a
# linear model of a nonlinear plant are not normally distributed: on records of the simulated rigs
# their excess kurtosis is 0.5 to 2.3. That of Student's t with 7 degrees of freedom is 2.
FALSE_ALARM = 0.01
TAIL = scipy.stats.t(7)
# Largest share of the samples that may exceed the threshold for normal noise, at the same rate of
# false alarms. A larger share is a property of the process or of its noise, not outliers.
MOST = 0.01
# A spike counts where its score is at least this share of the score of a process disturbance. The
# share is below 1 because a very large spike spoils the first model, and with that model it looks
# slightly more like a disturbance.
DOUBT = 0.9
# Interpolated values have converged when a pass changes them by at most this share of sigma.
CLOSE = 0.01
HIGHEST_ORDER = 4
ROWS_PER_PARAMETER = 10
# Each pass finds outliers that larger neighbours hid before. Records with few outliers need two or
# three passes.
PASSES = 10


@dataclass(frozen=True, eq=False)
class Outliers:
    """Report on the outliers of the output that were replaced."""

    positions: npt.NDArray[np.int64]
    """Sample numbers of the replaced samples, in order."""
    recorded: FloatArray
    """Recorded output at these samples."""
    threshold: float
    """Smallest spike that counts, in standard deviations of the estimated spike size; the standard
    deviation is estimated from the median. In a record of `n_examined` samples without spikes, any
    sample is replaced with a probability of at most 1 % (Bonferroni), if the residuals have the
    tails of Student's t with 7 degrees of freedom."""
    n_examined: int
    """Number of examined samples."""
    text: str
    """The result in words."""


def replace_outliers(data: IoData, estimation: IoData) -> tuple[FloatArray, Outliers]:
    """Returns the output with its spikes interpolated, shape as `data.y`, and a report.

    An ARX model of order 4, or of the highest order that the data determine, is fitted to the
    estimation part without the suspected samples. It then predicts the whole record one step
    ahead. A sample is an outlier if a spike at this sample explains the residuals that follow with
    a score above the threshold, and if this score is at least 0.9 of that of a process disturbance
    at any of these residuals. The outlier is replaced by the value that gives the smallest
    residuals together with the samples before and after it (interpolation by least squares). The
    input is never changed.

    Parameters
    ----------
    data
        the record.
    estimation
        estimation part of the record, with the same arrays.
    """
    model = _preliminary(estimation, data.y)
    if model is None:
        none = np.zeros(0, dtype=np.int64)
        text = "not looked for: the estimation part determines no model to tell them by"
        return data.y.copy(), Outliers(none, data.y[none], float("nan"), 0, text)

    # A model spoilt by a spike may take sound samples for spikes. The second time, the search
    # therefore starts again from the output as recorded, with the clean model of the first time.
    for _ in range(2):
        rounds = _rounds(data, estimation, model)
        model = rounds.model
    threshold, n = rounds.threshold, rounds.n_examined
    if len(rounds.suspects) > MOST * n:
        text = (
            f"more than {100 * MOST:g} % of {n} samples stand out further than normal noise: "
            "they are no outliers but the process or its noise, and stay as recorded"
        )
        none = np.zeros(0, dtype=np.int64)
        return data.y.copy(), Outliers(none, data.y[none], threshold, n, text)
    positions = np.array(sorted(rounds.outliers), dtype=np.int64)
    rate = f"threshold {threshold:.1f} sigma, false alarm {100 * FALSE_ALARM:g} % a record"
    text = f"{positions.size or 'none'} of {n} samples replaced ({rate})"
    return rounds.y, Outliers(positions, data.y[positions], threshold, n, text)


@dataclass(frozen=True, eq=False)
class _Rounds:
    """Result of `_rounds`: the output, the found and the suspected samples, and the model."""

    y: FloatArray
    outliers: set[int]
    suspects: set[int]
    model: ArxModel
    threshold: float
    n_examined: int


def _rounds(data: IoData, estimation: IoData, model: ArxModel) -> _Rounds:
    """Finds outliers, replaces them and estimates the model again, until nothing changes."""
    y = data.y.copy()
    outliers: set[int] = set()
    suspects: set[int] = set()
    threshold, n = float("nan"), 0
    for _ in range(PASSES):
        score, size, index, sigma = _spikes(replace(data, y=y), estimation, model)
        n = index.size
        tail = FALSE_ALARM / (2 * n)
        scale = float(scipy.stats.norm.ppf(0.75) / TAIL.ppf(0.75))
        threshold = scale * float(TAIL.isf(tail))
        peaks = _peaks(score, index, float(scipy.stats.norm.isf(tail)), model.orders.na)
        standing_out = outliers | {int(index[row]) for row in peaks}
        new = {int(index[row]) for row in peaks if score[row] > threshold} - outliers
        outliers |= new
        rows = np.flatnonzero(np.isin(index, sorted(outliers)))
        y[index[rows]] -= size[rows]
        same = not new and standing_out == suspects
        if same and np.all(np.abs(size[rows]) <= CLOSE * sigma):
            break
        # A suspected sample must not influence the model that judges it.
        suspects = standing_out
        model = _preliminary(_without(estimation, suspects), y) or model
    return _Rounds(y, outliers, suspects, model, threshold, n)


def _without(data: IoData, samples: set[int]) -> IoData:
    """Returns the data with segments divided so that no equation contains one of the samples."""
    segments = []
    for segment in data.segments:
        inside = sorted(k for k in samples if segment.start <= k < segment.stop)
        starts, stops = [segment.start, *(k + 1 for k in inside)], [*inside, segment.stop]
        segments += [slice(a, b) for a, b in zip(starts, stops, strict=True) if a < b]
    return replace(data, segments=tuple(segments))


def _preliminary(estimation: IoData, y: FloatArray) -> ArxModel | None:
    """Returns the ARX model of the highest order that the data determine; None if none is."""
    part = replace(estimation, y=y)
    for order in range(HIGHEST_ORDER, 0, -1):
        orders = ArxOrders(order, order, 1, offset=True)
        try:
            model = fit_arx(part, orders)
        except (UnexcitedError, TooFewSamplesError):
            continue
        if model.n_rows >= ROWS_PER_PARAMETER * orders.n_parameters:
            return model
    return None


def _spikes(
    data: IoData, estimation: IoData, model: ArxModel
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.int64], float]:
    """Returns score and size of a spike at each sample, the sample numbers, and sigma.

    The score is in standard deviations of the estimated size; it is 0 where a process disturbance
    explains the residuals better. The size is in the unit of the output. sigma is the standard
    deviation of the residual.
    """
    ahead = predict_one_step(model, data)
    e = ahead.residual
    trusted = np.isin(ahead.index, estimation.index)
    centre = float(np.median(e[trusted]))
    # A sensor with a coarse resolution gives many residuals of zero. The scale is therefore never
    # below the standard deviation of the sensor's rounding.
    steps = np.diff(np.unique(data.y[ahead.index]))
    rounding = float(np.min(steps)) / np.sqrt(12.0) if steps.size else 0.0
    floor = max(rounding, ROUNDING * float(np.max(np.abs(data.y))))
    sigma = max(1.4826 * float(np.median(np.abs(e[trusted] - centre))), floor)

    h = np.concatenate(([1.0], model.a))
    spikes, pushes, size = np.zeros_like(e), np.zeros_like(e), np.zeros_like(e)
    for run in ahead.runs:
        part = (e[run] - centre) / sigma
        n = part.size
        # d_hat(k) = sum_i h_i e(k+i) / sum_i h_i^2, over all i with k + i inside the run.
        matched = scipy.signal.lfilter(h, [1.0], part[::-1])[::-1]
        weight = np.cumsum(h**2)[np.minimum(np.arange(n - 1, -1, -1), h.size - 1)]
        spikes[run] = matched / np.sqrt(weight)
        ends = np.concatenate((np.abs(part), np.zeros(h.size - 1)))
        pushes[run] = np.lib.stride_tricks.sliding_window_view(ends, h.size).max(axis=1)
        size[run] = sigma * matched / weight
    # White residuals give a standard deviation of one. Where the residuals are not white, the score
    # is divided by their deviation, so that they are not taken for spikes.
    size_of = max(1.4826 * float(np.median(np.abs(spikes[trusted]))), 1.0)
    score = np.where(np.abs(spikes) >= DOUBT * pushes, np.abs(spikes) / size_of, 0.0)
    return score, size, ahead.index, sigma


def _peaks(
    score: FloatArray, index: npt.NDArray[np.int64], threshold: float, reach: int
) -> list[int]:
    """Returns the rows above the threshold, largest score first.

    A row hides its neighbours within `reach` samples, because they contain the same spike.
    """
    chosen: list[int] = []
    hidden = np.zeros(score.size, dtype=bool)
    for row in np.argsort(-score, kind="stable").tolist():
        if score[row] <= threshold:
            break
        if not hidden[row]:
            chosen.append(row)
            near = slice(max(row - reach, 0), row + reach + 1)
            hidden[near] |= np.abs(index[near] - index[row]) <= reach
    return chosen
