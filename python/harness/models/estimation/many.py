# SPDX-License-Identifier: MIT
"""Replays many records at once: their estimators run side by side in one bank.

Replays one record through the C++ estimator and evaluates the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

import ehsid

from ...base.numbers import FloatArray
from ..identification import ArxOrders, IdentificationError, IoData
from .recursion import START_VARIANCE, Estimate, EstimationResult, Recursion, scaling_of

# Samples between two looks at a bank, which bounds the memory of its trajectory.
CHUNK = 4096
GAP = float("nan")


@dataclass(frozen=True, eq=False)
class _Lane:
    """A record as one column for a bank."""

    data: IoData
    scaling: ehsid.Scaling
    estimator: ehsid.ArxEstimator
    u: FloatArray
    y: FloatArray
    """Shape (M,), the segments, each behind a sample of NaN: the estimator refuses it and clears
    its history, so that no regressor spans the gap between two segments."""
    sample: npt.NDArray[np.bool_]
    """Shape (M,), whether this is a sample of the record."""


@dataclass(frozen=True, eq=False)
class _Run:
    """An estimator at the end of its record, and what it gave for each sample, shape (M,)."""

    estimator: ehsid.ArxEstimator
    innovation: npt.NDArray[np.floating]
    status: npt.NDArray[np.uint8]

    def of(self, sample: npt.NDArray[np.bool_]) -> tuple[FloatArray, npt.NDArray[np.uint8]]:
        """Returns innovation and status of these samples only."""
        return self.innovation[sample].astype(np.float64), self.status[sample]


def estimate_all(
    records: Sequence[IoData], recursion: Recursion
) -> list[Estimate | IdentificationError]:
    """Runs the C++ estimator over each record; the figures are those of `estimate`, bit for bit.

    With the method "rls" all records run in one bank. An estimator whose record has ended is read
    before the bank goes on with those of the longer records.

    Parameters
    ----------
    records
        input and output of each; their lengths may differ.
    recursion
        settings of every estimator.

    Returns
    -------
    The figures of each record in order, or the error that `estimate` raises for it.

    Raises
    ------
    ValueError
        the structure is outside the compiled range, or the method does not take the policy.
    """
    found: dict[int, Estimate | IdentificationError] = {}
    lanes: dict[int, _Lane] = {}
    for i, data in enumerate(records):
        try:
            lanes[i] = _lane(data, recursion)
        except IdentificationError as error:
            found[i] = error
    for (i, lane), run in zip(
        lanes.items(), _run(list(lanes.values()), recursion.method), strict=True
    ):
        try:
            one = recursion.figures(lane.data, run.estimator, lane.scaling, *run.of(lane.sample))
            servo = recursion.servo(lane.data)
            found[i] = replace(one, servo=None if servo is None else servo.told)
        except IdentificationError as error:
            found[i] = error
    return [found[i] for i in range(len(records))]


def _lane(data: IoData, recursion: Recursion) -> _Lane:
    scaling = scaling_of(data)
    behind_gaps = np.cumsum([segment.stop - segment.start for segment in data.segments])[:-1]
    starts = np.concatenate(([0], behind_gaps))
    u, y = (
        np.insert(np.concatenate([signal[s] for s in data.segments]), starts, GAP)
        for signal in (data.u, data.y)
    )
    sample = np.ones(u.size, dtype=np.bool_)
    sample[starts + np.arange(starts.size)] = False
    return _Lane(data, scaling, recursion.estimator(scaling), u, y, sample)


def _run(lanes: Sequence[_Lane], method: str) -> list[_Run]:
    """Runs each estimator to the end of its record."""
    if method != "rls":  # a bank runs least squares only
        paths = [lane.estimator.run(lane.u, lane.y) for lane in lanes]
        return [
            _Run(lane.estimator, path.innovation, path.status)
            for lane, path in zip(lanes, paths, strict=True)
        ]
    if not lanes:
        return []
    bank = ehsid.EstimatorBank([lane.estimator for lane in lanes])
    sizes = [lane.u.size for lane in lanes]
    runs = [
        _Run(lane.estimator, np.empty(lane.u.size), np.empty(lane.u.size, dtype=np.uint8))
        for lane in lanes
    ]
    stops = sorted({*sizes, *range(CHUNK, max(sizes), CHUNK)})
    for start, stop in zip([0, *stops], stops, strict=False):
        u, y = (np.full((stop - start, len(lanes)), GAP) for _ in range(2))
        going = [i for i, size in enumerate(sizes) if size >= stop]
        for i in going:
            u[:, i], y[:, i] = lanes[i].u[start:stop], lanes[i].y[start:stop]
        path = bank.run(u, y)
        for i in going:
            runs[i].innovation[start:stop] = path.innovation[:, i]
            runs[i].status[start:stop] = path.status[:, i]
            if sizes[i] == stop:
                # The state behind the last sample of this record; the bank goes on without it.
                runs[i] = replace(runs[i], estimator=bank[i])
    return runs


def estimate(
    data: IoData,
    orders: ArxOrders,
    *,
    forgetting: ehsid.Forgetting,
    reset: bool = True,
    guards: ehsid.RlsOptions | None = None,
    start_variance: float = START_VARIANCE,
    dtype: str = "float32",
    method: str = "rls",
) -> EstimationResult:
    """Runs the C++ estimator over a record, segment by segment.

    Parameters
    ----------
    data
        input and output.
    orders, forgetting, reset, guards, start_variance, dtype, method
        as in `Recursion`.

    Raises
    ------
    IdentificationError
        a signal is constant, or the record has at most 20 equations per parameter.
    ValueError
        the structure is outside the compiled range, or the method does not take the policy.
    """
    recursion = Recursion(orders, forgetting, reset, guards, start_variance, dtype, method)
    return replace(replay(data, recursion), servo=recursion.servo(data))


def replay(data: IoData, recursion: Recursion) -> EstimationResult:
    """Runs the recursion alone: as `estimate`, but the record is not read as a servo."""
    scaling = scaling_of(data)
    estimator = recursion.estimator(scaling)
    paths = []
    for segment in data.segments:
        # The estimator refuses a NaN sample and clears its history. So no regressor spans the gap
        # between two segments.
        estimator.step(float("nan"), float("nan"))
        paths.append(estimator.run(data.u[segment], data.y[segment]))

    def joined(name: str) -> FloatArray:
        return np.concatenate([getattr(path, name) for path in paths]).astype(np.float64)

    innovation = joined("innovation")
    status = np.concatenate([path.status for path in paths])
    figures = recursion.figures(data, estimator, scaling, innovation, status)
    known = np.isfinite(innovation)
    deviation = joined("standard_deviation")
    deviation[np.cumsum(known) <= recursion.orders.n_parameters + 1] = np.nan
    if recursion.orders.offset:
        deviation[:, -1] = np.nan
        deviation[-1, -1] = figures.standard_deviation[-1]
    return EstimationResult(
        **vars(figures),
        theta_path=recursion.of_raw_signals(joined("theta"), scaling),
        deviation_path=deviation,
        innovation=innovation,
        forgetting_factor=np.where(known, joined("forgetting_factor"), np.nan),
        status=status,
    )
