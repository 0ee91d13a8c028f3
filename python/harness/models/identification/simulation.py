# SPDX-License-Identifier: MIT
"""Predicts the output with an ARX model: one step ahead, and as a free run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.signal

from ...base.arrays import FloatArray
from .arx import ArxModel
from .data import IoData
from .regression import regression


@dataclass(frozen=True, eq=False)
class Prediction:
    """Measured and predicted output, in the units of the data.

    Attributes
    ----------
    index
        shape (n,), sample numbers.
    measured, predicted
        shape (n,), measured and predicted output; the prediction of an unstable free run may end in
        non-finite values.
    runs
        slices of consecutive samples.
    """

    index: npt.NDArray[np.int64]
    measured: FloatArray
    predicted: FloatArray
    runs: tuple[slice, ...]

    @property
    def residual(self) -> FloatArray:
        """Residual, measured minus predicted output, shape (n,)."""
        return self.measured - self.predicted


def predict_one_step(model: ArxModel, data: IoData, *, skip: int | None = None) -> Prediction:
    """Returns the one-step prediction y_hat(k) = phi(k)' theta with measured past outputs, Eq. (8).

    Parameters
    ----------
    model
        estimated model.
    data
        input and output.
    skip
        samples left out at the start of each segment, see `regression`.
    """
    rows = regression(model.centre(data), model.orders, skip=skip)
    return Prediction(
        rows.index, data.y[rows.index], rows.phi @ model.theta + model.y_mean, rows.runs
    )


def simulate(model: ArxModel, data: IoData, *, skip: int | None = None) -> Prediction:
    """Simulates a free run, in which the past outputs are those of the model.

    A(q^-1) y_hat(k) = q^-nk B(q^-1) u(k) + offset. Each segment starts from its first `skip`
    measured outputs, which the result does not contain.

    Parameters
    ----------
    model
        estimated model.
    data
        input and output.
    skip
        samples left out at the start of each segment, see `regression`.
    """
    centred = model.centre(data)
    rows = regression(centred, model.orders, skip=skip)
    numerator = np.concatenate((np.zeros(model.orders.nk), model.b))
    denominator = np.concatenate(([1.0], model.a))
    simulated = np.empty(rows.y.size)
    for run in rows.runs:
        k = rows.index[run]
        past = k[0] - 1 - np.arange(model.orders.n_history)
        state = scipy.signal.lfiltic(numerator, denominator, centred.y[past], centred.u[past])
        free, _ = scipy.signal.lfilter(numerator, denominator, centred.u[k], zi=state)
        constant = np.full(k.size, model.offset)
        response = scipy.signal.lfilter([1.0], denominator, constant)
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable model may give infinities
            simulated[run] = free + response
    return Prediction(rows.index, data.y[rows.index], simulated + model.y_mean, rows.runs)
