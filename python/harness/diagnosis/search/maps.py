# SPDX-License-Identifier: MIT
"""Distribution of the calibrated error above the noise floor over regimes, frequency and time.

The errors of an output are divided by the rms of the measured output about its window's mean, as in
the nrmse of the contract. A share is a part of the sum of squares,
from which the sum of squares of the noise floor is subtracted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import dct

from ...base.arrays import FloatArray
from ...rigs import Rig
from ..data.bootstrap import drawn_windows, interval
from ..model.comparison import Compared
from ..schema import Band, Regime, Span, Value
from .conditions import conditions

# Conditions that hold for less than a hundredth of the time are not listed: that is 0.2 s of 20 s.
LEAST_TIME = 0.01
# Lower ends of the bands: drift; what a position loop follows; oil spring and valve; above both.
BANDS_HZ = (0.0, 2.0, 10.0, 50.0)
# A stretch of the record is listed if its windows, 2.5 s or more, hold 1.5 times their share of the
# gap.
SPAN_WINDOWS = 5
SPAN_EXCESS = 1.5


@dataclass(frozen=True)
class Maps:
    """Shares of the gap above the noise floor; empty where the errors do not exceed it."""

    regimes: tuple[Regime, ...] = ()
    frequency: tuple[Band, ...] = ()
    time: tuple[Span, ...] = ()


def maps(
    compared: Sequence[Compared],
    errors: Mapping[str, FloatArray],
    floors: Mapping[str, float],
    rig: Rig,
    *,
    seed: int = 0,
) -> Maps:
    """Computes the maps of the errors inside the windows of all records.

    Parameters
    ----------
    compared
        the records, in the order of the errors.
    errors
        simulated minus measured by output, shape (sum of the samples inside windows,), as
        `Problem.errors` gives them.
    floors
        standard deviation of the noise by output, in the unit of the output.
    rig
        the rig as configured.
    seed
        seed of the bootstrap over whole windows.
    """
    spread = {
        name: float(np.mean(np.concatenate([c.centred(c.outputs[name]) for c in compared]) ** 2))
        for name in errors
    }
    window = window_numbers_of(compared)
    shares = [(e, spread[name], floors[name] ** 2) for name, e in errors.items()]
    energy = np.sum([(e**2 - f) / s for e, s, f in shares], axis=0)
    by_window = np.asarray(np.bincount(window, energy), dtype=np.float64)
    if float(by_window.sum()) <= 0.0:
        return Maps()
    draws = drawn_windows(by_window.size, seed)
    regimes = []
    for condition, holds in conditions(compared, rig).items():
        of_time = float(np.mean(holds))
        if of_time >= LEAST_TIME:
            inside = np.asarray(np.bincount(window, energy * holds), dtype=np.float64)
            share = _share(inside, by_window, draws)
            regimes.append(Regime(condition, share.value, of_time, share.ci90))
    regimes.sort(key=lambda regime: -regime.share)
    return Maps(
        tuple(regimes),
        tuple(_bands(compared, shares, window, by_window, draws)),
        tuple(_spans(compared, by_window)),
    )


def window_numbers_of(compared: Sequence[Compared]) -> npt.NDArray[np.int64]:
    """Returns the window number of each sample inside windows, counted through all records."""
    numbers: list[npt.NDArray[np.int64]] = []
    offset = 0
    for record in compared:
        _, inside = np.unique(record.window[record.used], return_inverse=True)
        numbers.append(inside.astype(np.int64) + offset)
        offset = int(numbers[-1][-1]) + 1
    return np.concatenate(numbers)


def _share(part: FloatArray, whole: FloatArray, draws: npt.NDArray[np.int64]) -> Value:
    """Returns the share of `part` in `whole`, both summed over windows, inside [0, 1].

    The interval follows from a bootstrap over windows.
    """
    wholes = whole[draws].sum(axis=1)
    positive = wholes > 0.0
    drawn = part[draws].sum(axis=1)[positive] / wholes[positive]
    value = float(part.sum() / whole.sum())
    low, high = interval(drawn)
    value, low, high = np.clip([value, min(low, value), max(high, value)], 0.0, 1.0).tolist()
    return Value(value, (low, high))


def _bands(
    compared: Sequence[Compared],
    shares: Sequence[tuple[FloatArray, float, float]],
    window: npt.NDArray[np.int64],
    by_window: FloatArray,
    draws: npt.NDArray[np.int64],
) -> list[Band]:
    """Returns the share of each frequency band, from the cosine transform (DCT-II) of each window.

    The transform is orthonormal, so that its squares add up to those of the samples. It continues a
    window evenly, so that a drift over the window does not leak into all bands as with a Fourier
    transform (N. Ahmed, T. Natarajan, K. R. Rao, IEEE Trans. Comput. C-23, 1974).
    """
    nyquist = 0.5 / max(record.dt_s for record in compared)
    edges = [edge for edge in BANDS_HZ if edge < nyquist] + [nyquist]
    inside = np.zeros((len(edges) - 1, by_window.size))
    dts = np.concatenate(
        [np.full(np.count_nonzero(record.used), record.dt_s) for record in compared]
    )
    begins = np.flatnonzero(np.diff(window, prepend=-1))
    for number, (begin, end) in enumerate(zip(begins, [*begins[1:], window.size], strict=True)):
        # Coefficient k has k / 2 periods over the n samples of the window.
        hz = 0.5 * np.arange(end - begin) / ((end - begin) * dts[begin])
        band = np.minimum(np.searchsorted(edges, hz, side="right"), len(edges) - 1) - 1
        power = np.sum(
            [(dct(e[begin:end], norm="ortho") ** 2 - f) / s for e, s, f in shares], axis=0
        )
        inside[:, number] = np.bincount(band, power, minlength=len(edges) - 1)
    return [
        Band((float(low), float(high)), share.value, share.ci90)
        for low, high, part in zip(edges, edges[1:], inside, strict=False)
        for share in (_share(part, by_window, draws),)
    ]


def _spans(compared: Sequence[Compared], by_window: FloatArray) -> list[Span]:
    """Returns the stretches of the records that hold much more of the gap than others.

    They consist of runs of SPAN_WINDOWS windows, each with over SPAN_EXCESS times its mean share.
    """
    total, offset, spans = float(by_window.sum()), 0, []
    least_share = SPAN_EXCESS * SPAN_WINDOWS / by_window.size
    ones = np.ones(SPAN_WINDOWS)
    for compared_record in compared:
        samples = np.flatnonzero(compared_record.used)
        numbers, first = np.unique(compared_record.window[samples], return_index=True)
        ends = samples[np.append(first[1:], samples.size) - 1] + 1
        share = by_window[offset : offset + numbers.size] / total
        offset += numbers.size
        start_s = (
            0.0
            if compared_record.record.time_s is None
            else float(compared_record.record.time_s[0])
        )
        # Other blocks lie between those that are held out; a stretch does not reach across them.
        for part in np.split(np.arange(numbers.size), np.flatnonzero(np.diff(numbers) > 1) + 1):
            if part.size < SPAN_WINDOWS:
                continue
            exceeds = np.convolve(share[part], ones, mode="valid") > least_share
            member = np.convolve(exceeds, ones) > 0.5
            edges = np.flatnonzero(np.diff(np.concatenate([[False], member, [False]])))
            for begin, end in part[0] + edges.reshape(-1, 2):
                span_s = (
                    start_s + float(samples[first[begin]]) * compared_record.dt_s,
                    start_s + float(ends[end - 1]) * compared_record.dt_s,
                )
                gap_share = float(share[begin:end].sum())
                spans.append(Span(span_s, gap_share, compared_record.record.name))
    return spans
