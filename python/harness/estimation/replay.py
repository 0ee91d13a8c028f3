# SPDX-License-Identifier: MIT
"""Replays one record through the C++ estimator and evaluates the fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.identification import (
    ArxModel,
    ArxOrders,
    IdentificationError,
    IoData,
    fit_percent,
    simulate,
)

# Half width of a two-sided 95 % interval of a normal distribution, in standard deviations.
NORMAL_95 = 1.959963984540054

# Number of equations per parameter that count as start-up.
START_VARIANCE = 1e6  # of ServoEstimator
START_EQUATIONS = 10


@dataclass(frozen=True, eq=False)
class EstimationResult:
    """Result of the recursive estimation over a record of N samples with n parameters.

    Attributes
    ----------
    orders
        structure of the model.
    forgetting
        the forgetting policy, in words.
    method
        "rls", "riv", "oe" or "armax", see `ehsid.ServoEstimator`.
    theta, standard_deviation
        shape (n,), estimate and its standard deviation at the end of the record, in the units of
        the signals with their means removed.
    theta_path, deviation_path
        shape (N, n), estimate and its standard deviation after each sample. The deviations are NaN
        for the first n + 1 equations, which do not determine the size of the noise.
    innovation
        shape (N,), measured minus predicted output; NaN where nothing was estimated.
    forgetting_factor
        shape (N,), forgetting factor lambda; NaN where nothing was estimated.
    status
        shape (N,), codes of `ehsid.Status`.
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
    resets, converged, skipped
        number of detected changes; whether the estimate has converged at the end; number of
        samples without information.
    residuals_white, whiteness
        whether the residuals pass the test of `WhitenessMonitor` at the end, and its statistic. If
        they do not, the parameters are biased, and `standard_deviation` is enlarged but may still
        be too small.
    """

    orders: ArxOrders
    forgetting: str
    method: str
    theta: FloatArray
    standard_deviation: FloatArray
    theta_path: FloatArray
    deviation_path: FloatArray
    innovation: FloatArray
    forgetting_factor: FloatArray
    status: npt.NDArray[np.uint8]
    n_start: int
    rmse: float
    one_step_fit_percent: float
    simulation_fit_percent: float
    resets: int
    converged: bool
    skipped: int
    residuals_white: bool
    whiteness: float

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
            "n_start": self.n_start,
            "rmse": self.rmse,
            "one_step_fit_percent": self.one_step_fit_percent,
            "simulation_fit_percent": self.simulation_fit_percent if finite else None,
            "resets": self.resets,
            "converged": self.converged,
            "skipped": self.skipped,
            "residuals_white": self.residuals_white,
            "whiteness": self.whiteness,
        }


def scaling_of(data: IoData) -> ehsid.Scaling:
    """Returns a scaling with the means of the record as offsets, the standard deviations as scales.

    Raises
    ------
    IdentificationError
        a signal is constant.
    """
    parts = [data.u[s] for s in data.segments], [data.y[s] for s in data.segments]
    u, y = (np.concatenate(part) for part in parts)
    for name, values in ((data.input_name, u), (data.output_name, y)):
        if float(np.ptp(values)) == 0.0:
            raise IdentificationError(
                f"{name} is constant: expected a signal that varies; record the plant in motion, "
                "or name other columns"
            )
    return ehsid.Scaling(
        command_scale=float(np.std(u)),
        position_scale=float(np.std(y)),
        command_offset=float(np.mean(u)),
        position_offset=float(np.mean(y)),
    )


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
    orders
        structure of the model, na and nb up to 6, nk up to 20.
    forgetting
        forgetting policy, e.g. `ehsid.Exponential()`.
    reset
        whether lambda and P are reset when the RMSE shows a change of the plant.
    guards
        guards against wind-up; None takes the defaults, `ehsid.RlsOptions.textbook()` has none.
    start_variance
        P_ii at the start and after a reset, above 0, of the scaled signals in units of sigma^2.
    dtype
        "float32", as on the target, or "float64".
    method
        "rls", or for noise that biases least squares "riv", "oe" or "armax".

    Raises
    ------
    IdentificationError
        a signal is constant, or the record has at most 20 equations per parameter.
    ValueError
        the structure is outside the compiled range, or the method does not take the policy.
    """
    scaling = scaling_of(data)
    estimator = ehsid.ServoEstimator(
        orders.na,
        orders.nb,
        orders.nk,
        offset=orders.offset,
        forgetting=forgetting,
        scaling=scaling,
        rls=guards or ehsid.RlsOptions(),
        reset=ehsid.RmseResetOptions() if reset else None,
        variance0=[start_variance] * orders.n_parameters,
        dtype=dtype,
        method=method,
    )
    paths = []
    for segment in data.segments:
        # The estimator refuses a NaN sample and clears its history. So no regressor spans the gap
        # between two segments.
        estimator.step(float("nan"), float("nan"))
        paths.append(estimator.run(data.u[segment], data.y[segment]))

    def joined(name: str) -> FloatArray:
        return np.concatenate([getattr(path, name) for path in paths]).astype(np.float64)

    measured = np.concatenate([data.y[segment] for segment in data.segments])
    innovation = joined("innovation")
    known = np.isfinite(innovation)
    n_start = START_EQUATIONS * orders.n_parameters
    if np.count_nonzero(known) <= 2 * n_start:
        raise IdentificationError(
            f"{measured.size} samples leave {np.count_nonzero(known)} equations for "
            f"{orders.n_parameters} parameters: expected more than {2 * n_start}; record longer, "
            "or take lower orders"
        )
    settled = known & (np.cumsum(known) > n_start)
    deviation = joined("standard_deviation")
    deviation[np.cumsum(known) <= orders.n_parameters + 1] = np.nan
    theta = np.asarray(estimator.theta_hat, dtype=np.float64)
    status = np.concatenate([path.status for path in paths])
    model = ArxModel(
        orders,
        theta,
        np.asarray(estimator.covariance, dtype=np.float64),
        float(estimator.residual_variance),
        float(np.mean(innovation[settled] ** 2)),
        int(np.count_nonzero(settled)),
        u_mean=scaling.command_offset,
        y_mean=scaling.position_offset,
    )
    free_run = simulate(model, data)
    return EstimationResult(
        orders=orders,
        forgetting=repr(forgetting),
        method=method,
        theta=theta,
        standard_deviation=np.asarray(estimator.standard_deviation, dtype=np.float64),
        theta_path=joined("theta"),
        deviation_path=deviation,
        innovation=innovation,
        forgetting_factor=np.where(known, joined("forgetting_factor"), np.nan),
        status=status,
        n_start=n_start,
        rmse=float(np.sqrt(np.mean(innovation[settled] ** 2))),
        one_step_fit_percent=fit_percent(
            measured[settled], measured[settled] - innovation[settled]
        ),
        simulation_fit_percent=fit_percent(free_run.measured, free_run.predicted),
        resets=estimator.resets,
        converged=estimator.converged,
        skipped=int(np.count_nonzero(status == ehsid.Status.no_information)),
        residuals_white=estimator.residuals_white,
        whiteness=estimator.whiteness,
    )
