# SPDX-License-Identifier: MIT
"""What a recursive estimation over a record gives: its figures at the end, and its paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray
from ..identification import ArxOrders
from .servo import ServoPath

# Half width of a two-sided 95 % interval of a normal distribution, in standard deviations.
NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, eq=False)
class Estimate:
    """Figures of the recursive estimation of n parameters, at the end of a record.

    Attributes
    ----------
    orders
        structure of the model.
    forgetting
        the forgetting policy, in words.
    method
        "rls" or "riv", see `ehsid.ArxEstimator`.
    theta, standard_deviation
        shape (n,), estimate and its standard deviation at the end of the record, in the units of
        the signals. The constant term is that of the signals as they are in the record, as in
        `identify`.
    u_mean, y_mean
        means that the signals of the model lack: those of the record without a constant term, 0
        with one.
    times_tolerance
        shape (n,), standard deviation over the largest with which a parameter counts as settled, of
        the scaled parameters that `ConvergenceMonitor` judges.
    n_samples
        number of samples in the segments of the record.
    n_start
        number of start-up equations that `rmse` and `one_step_fit_percent` leave out: 10 per
        parameter. The start values are so uncertain that the first few predictions have large
        errors, which would determine both figures.
    rmse
        root mean square of the innovation after the start-up, in the unit of the output.
    one_step_fit_percent
        fit in percent, after the start-up, of the prediction made at each sample with the
        parameters of the sample before.
    simulation_fit_percent
        fit in percent of a free run over the whole record with the final parameters.
    resets, skipped
        number of detected changes, and of samples without information.
    settled, converged
        whether each parameter is determined to 5 % at the end, computed as if the residuals were
        white; whether they also show no sign that they are not.
    residuals_white, whiteness
        whether the residuals pass the test of `WhitenessMonitor` at the end, and its statistic. If
        they do not, the parameters are biased, and `standard_deviation` is enlarged but may still
        be too small.
    servo
        the record read as a servo by `ehsid.ServoEstimator`; None where the model is not of the
        orders of a servo, na = nb = 3, or the sampling time is not known.
    """

    orders: ArxOrders
    forgetting: str
    method: str
    theta: FloatArray
    standard_deviation: FloatArray
    u_mean: float
    y_mean: float
    times_tolerance: FloatArray
    n_samples: int
    n_start: int
    rmse: float
    one_step_fit_percent: float
    simulation_fit_percent: float
    resets: int
    settled: bool
    converged: bool
    skipped: int
    residuals_white: bool
    whiteness: float
    servo: ServoPath | None

    def to_dict(self) -> dict[str, Any]:
        """Returns plain values for JSON, without the paths: they are data, not results."""
        finite = np.isfinite(self.simulation_fit_percent)
        return {
            "na": self.orders.na,
            "nb": self.orders.nb,
            "nk": self.orders.nk,
            "forgetting": self.forgetting,
            "method": self.method,
            "parameters": {
                name: {"value": value, "ci95": [value - width, value + width]}
                for name, value, width in zip(
                    self.orders.names,
                    self.theta.tolist(),
                    (NORMAL_95 * self.standard_deviation).tolist(),
                    strict=True,
                )
            },
            "u_mean": self.u_mean,
            "y_mean": self.y_mean,
            "n_start": self.n_start,
            "rmse": self.rmse,
            "one_step_fit_percent": self.one_step_fit_percent,
            "simulation_fit_percent": self.simulation_fit_percent if finite else None,
            "resets": self.resets,
            "settled": self.settled,
            "converged": self.converged,
            "skipped": self.skipped,
            "residuals_white": self.residuals_white,
            "whiteness": self.whiteness,
            "servo": None if self.servo is None else self.servo.to_dict(),
        }


@dataclass(frozen=True, eq=False)
class EstimationResult(Estimate):
    """Figures at the end of a record of N samples, and the paths that lead there.

    Attributes
    ----------
    theta_path, deviation_path
        shape (N, n), estimate and its standard deviation after each sample. The deviations are NaN
        for the first n + 1 equations, which do not determine the size of the noise. That of the
        constant term is known at the end only: it needs the whole covariance.
    innovation
        shape (N,), measured minus predicted output; NaN where nothing was estimated.
    forgetting_factor
        shape (N,), forgetting factor lambda; NaN where nothing was estimated.
    status
        shape (N,), codes of `ehsid.Status`.
    """

    theta_path: FloatArray
    deviation_path: FloatArray
    innovation: FloatArray
    forgetting_factor: FloatArray
    status: npt.NDArray[np.uint8]
