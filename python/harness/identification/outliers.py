# SPDX-License-Identifier: MIT
"""Spikes of the measured output, told from events of the process, and interpolated.

A spike d at sample k of the output (additive outlier) leaves d (1, a1, .., a_na) in the residuals
of an ARX model from k on; a push of the process (innovational outlier) leaves one residual.
A. J. Fox, "Outliers in time series", J. R. Stat. Soc. B 34(3), 1972; I. Chang, G. C. Tiao, C. Chen,
"Estimation of time series parameters in the presence of outliers", Technometrics 30(2), 1988. The
scale of the residuals is Hampel's, 1.4826 median |e - median e| (F. R. Hampel, "The influence
curve and its role in robust estimation", J. Am. Stat. Assoc. 69, 1974).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.signal
import scipy.stats

from ehsid.harness.arrays import FloatArray
from ehsid.harness.identification.arx import ArxModel, fit_arx
from ehsid.harness.identification.data import IoData
from ehsid.harness.identification.errors import TooFewSamplesError, UnexcitedError
from ehsid.harness.identification.orders import ArxOrders
from ehsid.harness.identification.simulation import predict_one_step

# Probability that a record without spikes has a sample replaced at all. Residuals that a linear
# model leaves of a nonlinear plant are no normal noise: on records of the simulated rigs their
# excess kurtosis is 0.5 to 2.3. That of Student's t with 7 degrees of freedom is 2.
FALSE_ALARM = 0.01
TAIL = scipy.stats.t(7)
# Share of the samples that may stand out further than normal noise does, at the same rate of false
# alarms; beyond it they are no outliers but the way the process is.
MOST = 0.01
# A spike so large that it spoils the first model looks like a push to it, but for little.
DOUBT = 0.9
# Interpolated values count as found when a pass changes them by less than this, of sigma.
CLOSE = 0.01
HIGHEST_ORDER = 4
ROWS_PER_PARAMETER = 10
# Each pass finds those that larger neighbours hid; records with few outliers need two or three.
PASSES = 10
# Residuals below this share of the output are rounding, as in `identify`.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Outliers:
    """What was looked for in the output and found.

    Attributes
    ----------
    positions
        sample numbers of those replaced, in order.
    recorded
        the output there as recorded.
    threshold
        in standard deviations of the estimated size, as told from the median; by it a record of
        `n_examined` samples without spikes has any replaced with a probability of 1 % at most
        (Bonferroni), if its residuals have the tails of Student's t with 7 degrees of freedom.
    n_examined
        samples looked at.
    text
        the same in words.
    """

    positions: npt.NDArray[np.int64]
    recorded: FloatArray
    threshold: float
    n_examined: int
    text: str


def replace_outliers(data: IoData, estimation: IoData) -> tuple[FloatArray, Outliers]:
    """The output with its spikes interpolated, shape as `data.y`, and a report.

    An ARX model of order 4, or the highest that the data determine, is fitted to the estimation
    part, without samples under suspicion, and run over the whole record. A sample is an outlier
    where a spike explains the residuals from it on with more than the threshold, and better than a
    push of the process at any of them. It is replaced by the value that, with the samples before
    and after it, leaves the smallest residuals: the interpolation by least squares. The input is
    never touched.

    Parameters
    ----------
    data
        the record.
    estimation
        its estimation part, of the same arrays.
    """
    model = _preliminary(estimation, data.y)
    if model is None:
        none = np.zeros(0, dtype=np.int64)
        text = "not looked for: the estimation part determines no model to tell them by"
        return data.y.copy(), Outliers(none, data.y[none], float("nan"), 0, text)

    # A model that a spike has spoilt may take others for one: the second time a clean one looks at
    # the output as recorded.
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
    positions = np.array(sorted(rounds.found), dtype=np.int64)
    rate = f"threshold {threshold:.1f} sigma, false alarm {100 * FALSE_ALARM:g} % a record"
    text = f"{positions.size or 'none'} of {n} samples replaced ({rate})"
    return rounds.y, Outliers(positions, data.y[positions], threshold, n, text)


@dataclass(frozen=True, eq=False)
class _Rounds:
    """What the rounds of `_rounds` end with: the output, found and suspected samples, the model."""

    y: FloatArray
    found: set[int]
    suspects: set[int]
    model: ArxModel
    threshold: float
    n_examined: int


def _rounds(data: IoData, estimation: IoData, model: ArxModel) -> _Rounds:
    """Find, replace, estimate anew, until nothing changes."""
    y = data.y.copy()
    found: set[int] = set()
    suspects: set[int] = set()
    threshold, n = float("nan"), 0
    for _ in range(PASSES):
        score, size, index, sigma = _spikes(replace(data, y=y), estimation, model)
        n = index.size
        tail = FALSE_ALARM / (2 * n)
        scale = float(scipy.stats.norm.ppf(0.75) / TAIL.ppf(0.75))
        threshold = scale * float(TAIL.isf(tail))
        peaks = _peaks(score, index, float(scipy.stats.norm.isf(tail)), model.orders.na)
        standing_out = found | {int(index[row]) for row in peaks}
        new = {int(index[row]) for row in peaks if score[row] > threshold} - found
        found |= new
        rows = np.flatnonzero(np.isin(index, sorted(found)))
        y[index[rows]] -= size[rows]
        same = not new and standing_out == suspects
        if same and np.all(np.abs(size[rows]) <= CLOSE * sigma):
            break
        # The model must not owe itself to what it is to judge.
        suspects = standing_out
        model = _preliminary(_without(estimation, suspects), y) or model
    return _Rounds(y, found, suspects, model, threshold, n)


def _without(data: IoData, samples: set[int]) -> IoData:
    """The same, its segments divided so that no equation contains one of the samples."""
    segments = []
    for segment in data.segments:
        inside = sorted(k for k in samples if segment.start <= k < segment.stop)
        starts, stops = [segment.start, *(k + 1 for k in inside)], [*inside, segment.stop]
        segments += [slice(a, b) for a, b in zip(starts, stops, strict=True) if a < b]
    return replace(data, segments=tuple(segments))


def _preliminary(estimation: IoData, y: FloatArray) -> ArxModel | None:
    """The ARX model of the highest order that the data determine, None if there is none."""
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
    """At each sample: how far a spike stands out, 0 if a push explains more, its size, the sample's
    number; and the standard deviation of the residual.
    """
    ahead = predict_one_step(model, data)
    e = ahead.residual
    trusted = np.isin(ahead.index, _numbers(estimation))
    centre = float(np.median(e[trusted]))
    # A sensor that reads in steps has residuals of zero: no scale below that of its rounding.
    steps = np.diff(np.unique(data.y[ahead.index]))
    rounding = float(np.min(steps)) / np.sqrt(12.0) if steps.size else 0.0
    floor = max(rounding, ROUNDING * float(np.max(np.abs(data.y))))
    sigma = max(1.4826 * float(np.median(np.abs(e[trusted] - centre))), floor)

    h = np.concatenate(([1.0], model.a))
    spikes, pushes, size = np.zeros_like(e), np.zeros_like(e), np.zeros_like(e)
    for run in ahead.runs:
        part = (e[run] - centre) / sigma
        n = part.size
        # d_hat(k) = sum_i h_i e(k+i) / sum_i h_i^2, over those i that lie before the end.
        matched = scipy.signal.lfilter(h, [1.0], part[::-1])[::-1]
        weight = np.cumsum(h**2)[np.minimum(np.arange(n - 1, -1, -1), h.size - 1)]
        spikes[run] = matched / np.sqrt(weight)
        ends = np.concatenate((np.abs(part), np.zeros(h.size - 1)))
        pushes[run] = np.lib.stride_tricks.sliding_window_view(ends, h.size).max(axis=1)
        size[run] = sigma * matched / weight
    # White residuals give a deviation of one. Where the model leaves others, they are not taken for
    # spikes: the deviation found counts.
    size_of = max(1.4826 * float(np.median(np.abs(spikes[trusted]))), 1.0)
    score = np.where(np.abs(spikes) >= DOUBT * pushes, np.abs(spikes) / size_of, 0.0)
    return score, size, ahead.index, sigma


def _peaks(
    score: FloatArray, index: npt.NDArray[np.int64], threshold: float, reach: int
) -> list[int]:
    """Rows beyond the threshold, largest first; one hides its neighbours, which share its spike."""
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


def _numbers(data: IoData) -> npt.NDArray[np.int64]:
    """Sample numbers inside the segments."""
    return np.concatenate([np.arange(s.start, s.stop) for s in data.segments])
