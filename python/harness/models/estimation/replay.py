# SPDX-License-Identifier: MIT
"""Replays one record through the C++ estimator and evaluates the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import ehsid

from ...base.arrays import FloatArray
from ..identification import ArxOrders, IoData
from .recursion import START_VARIANCE, Recursion, scaling_of
from .result import EstimationResult


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
