# SPDX-License-Identifier: MIT
"""The settings of a recursive estimation, and its figures once it has run over a record.

What a recursive estimation over a record gives: its figures at the end, and its paths.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import ehsid

from ...base.numbers import FloatArray
from ..identification import ArxModel, ArxOrders, IdentificationError, IoData, fit_percent, simulate
from .servo import ServoPath, estimate_servo

# Half width of a two-sided 95 % interval of a normal distribution, in standard deviations.
NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, eq=False)
class Estimate:
    """Figures of the recursive estimation of n parameters, at the end of a record.

    Attributes
    ----------
    resets, skipped
        number of detected changes, and of samples without information.
    """

    orders: ArxOrders
    """Structure of the model."""
    forgetting: str
    """The forgetting policy, in words."""
    method: str
    """"rls" or "riv", see `ehsid.ArxEstimator`."""
    theta: FloatArray
    standard_deviation: FloatArray
    """Shape (n,), estimate and its standard deviation at the end of the record, in the units of the
    signals. The constant term is that of the signals as they are in the record, as in `identify`.
    """
    u_mean: float
    y_mean: float
    """Means that the signals of the model lack: those of the record without a constant term, 0 with
    one."""
    times_tolerance: FloatArray
    """Shape (n,), standard deviation over the largest with which a parameter counts as settled, of
    the scaled parameters that `ConvergenceMonitor` judges."""
    n_samples: int
    """Number of samples in the segments of the record."""
    n_start: int
    """Number of start-up equations that `rmse` and `one_step_fit_percent` leave out: 10 per
    parameter. The start values are so uncertain that the first few predictions have large errors,
    which would determine both figures."""
    rmse: float
    """Root mean square of the innovation after the start-up, in the unit of the output."""
    one_step_fit_percent: float
    """Fit in percent, after the start-up, of the prediction made at each sample with the parameters
    of the sample before."""
    simulation_fit_percent: float
    """Fit in percent of a free run over the whole record with the final parameters."""
    resets: int
    settled: bool
    converged: bool
    """Whether each parameter is determined to 5 % at the end, computed as if the residuals were
    white; whether they also show no sign that they are not."""
    skipped: int
    residuals_white: bool
    whiteness: float
    """Whether the residuals pass the test of `WhitenessMonitor` at the end, and its statistic. If
    they do not, the parameters are biased, and `standard_deviation` is enlarged but may still be
    too small."""
    servo: ServoPath | None
    """The record read as a servo by `ehsid.ServoEstimator`; None where the model is not of the
    orders of a servo, na = nb = 3, or the sampling time is not known."""

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
    """Figures at the end of a record of N samples, and the paths that lead there."""

    theta_path: FloatArray
    deviation_path: FloatArray
    """Shape (N, n), estimate and its standard deviation after each sample. The deviations are NaN
    for the first n + 1 equations, which do not determine the size of the noise. That of the
    constant term is known at the end only: it needs the whole covariance."""
    innovation: FloatArray
    """Shape (N,), measured minus predicted output; NaN where nothing was estimated."""
    forgetting_factor: FloatArray
    """Shape (N,), forgetting factor lambda; NaN where nothing was estimated."""
    status: npt.NDArray[np.uint8]
    """Shape (N,), codes of `ehsid.Status`."""


START_VARIANCE = 1e6  # of ArxEstimator
# Of ArxEstimator: largest relative deviation of what has settled, and size below which a scaled
# parameter is judged as if it had this one.
TOLERANCE = ehsid.ConvergenceOptions().tolerance
MAGNITUDE = ehsid.ConvergenceOptions().magnitude
# Number of equations per parameter that count as start-up.
START_EQUATIONS = 10


@dataclass(frozen=True)
class Recursion:
    """Settings of an estimator, the same for every record."""

    orders: ArxOrders
    """Structure of the model, na and nb up to 6, nk up to 20. Without a constant term the model
    takes the mean command of the record for the one at which the output stands still."""
    forgetting: ehsid.Forgetting
    """Forgetting policy, e.g. `ehsid.Exponential()`."""
    reset: bool = True
    """Whether lambda and P are reset when the RMSE shows a change of the plant."""
    guards: ehsid.RlsOptions | None = None
    """Guards against wind-up; None takes the defaults, `ehsid.RlsOptions.textbook()` has none."""
    start_variance: float = START_VARIANCE
    """P_ii at the start and after a reset, above 0, of the scaled signals in units of sigma^2."""
    dtype: str = "float32"
    """"float32", as on the target, or "float64"."""
    method: str = "rls"
    """"rls", or for noise of the position sensor "riv"."""

    def estimator(self, scaling: ehsid.Scaling | None = None) -> ehsid.ArxEstimator:
        """Returns an estimator with these settings.

        Raises
        ------
        ValueError
            the structure is outside the compiled range, or the method does not take the policy.
        """
        return ehsid.ArxEstimator(
            self.orders.na,
            self.orders.nb,
            self.orders.nk,
            offset=self.orders.offset,
            forgetting=self.forgetting,
            scaling=scaling or ehsid.Scaling(),
            rls=self.guards or ehsid.RlsOptions(),
            reset=ehsid.RmseResetOptions() if self.reset else None,
            variance0=[self.start_variance] * self.orders.n_parameters,
            dtype=self.dtype,
            method=self.method,
        )

    def figures(
        self,
        data: IoData,
        estimator: ehsid.ArxEstimator,
        scaling: ehsid.Scaling,
        innovation: FloatArray,
        status: npt.NDArray[np.uint8],
    ) -> Estimate:
        """Returns the figures of an estimator that has run over a record, without its servo.

        Parameters
        ----------
        data
            the record, with N samples in its segments.
        estimator, scaling
            the estimator after the last sample, and the scaling it was made with.
        innovation, status
            shape (N,), what the estimator gave for each sample.

        Raises
        ------
        IdentificationError
            the record has at most 20 equations per parameter.
        """
        measured = np.concatenate([data.y[segment] for segment in data.segments])
        known = np.isfinite(innovation)
        n_start = START_EQUATIONS * self.orders.n_parameters
        if np.count_nonzero(known) <= 2 * n_start:
            raise IdentificationError(
                f"{measured.size} samples leave {np.count_nonzero(known)} equations for "
                f"{self.orders.n_parameters} parameters: expected more than {2 * n_start}; record "
                "longer, or take lower orders"
            )
        settled = known & (np.cumsum(known) > n_start)
        theta = np.asarray(estimator.theta_hat, dtype=np.float64)
        deviation = np.asarray(estimator.standard_deviation, dtype=np.float64)
        covariance = np.asarray(estimator.covariance, dtype=np.float64)
        scale = self._scale(scaling)
        squares = float(np.mean(innovation[settled] ** 2))
        model = ArxModel(
            self.orders,
            theta,
            covariance,
            float(estimator.residual_variance),
            squares,
            int(np.count_nonzero(settled)),
            u_mean=scaling.command_offset,
            y_mean=scaling.position_offset,
        )
        free_run = simulate(model, data)
        return Estimate(
            orders=self.orders,
            forgetting=repr(self.forgetting),
            method=self.method,
            theta=self.of_raw_signals(theta, scaling),
            standard_deviation=self._raw_deviation(deviation, covariance, scaling),
            u_mean=0.0 if self.orders.offset else scaling.command_offset,
            y_mean=0.0 if self.orders.offset else scaling.position_offset,
            times_tolerance=scale
            * deviation
            / (TOLERANCE * np.maximum(np.abs(scale * theta), MAGNITUDE)),
            n_samples=measured.size,
            n_start=n_start,
            rmse=float(np.sqrt(squares)),
            one_step_fit_percent=fit_percent(
                measured[settled], measured[settled] - innovation[settled]
            ),
            simulation_fit_percent=fit_percent(free_run.measured, free_run.predicted),
            resets=estimator.resets,
            settled=estimator.settled,
            converged=estimator.converged,
            skipped=int(np.count_nonzero(status == ehsid.Status.no_information)),
            residuals_white=estimator.residuals_white,
            whiteness=estimator.whiteness,
            servo=None,
        )

    def servo(self, data: IoData) -> ServoPath | None:
        """Reads a record as a servo; None where the orders are not those of Eq. (6)."""
        of_a_servo = self.orders.na == 3 and self.orders.nb == 3
        return estimate_servo(data, self.orders.nk, self.dtype) if of_a_servo else None

    def of_raw_signals(self, theta: FloatArray, scaling: ehsid.Scaling) -> FloatArray:
        """Returns estimates with the constant term of the signals as they are in the record.

        Parameters
        ----------
        theta
            shape (..., n), of the signals less the offsets of the scaling, as the estimator has it.
        scaling
            of the estimator.
        """
        raw = theta.copy()
        if self.orders.offset:
            constant = np.sum(theta * self._to_raw(scaling), axis=-1)
            raw[..., -1] = constant + scaling.position_offset
        return raw

    def _to_raw(self, scaling: ehsid.Scaling) -> FloatArray:
        """Returns the weights of theta in the constant of the raw signals, less their mean output.

        y - y_m = -a (y - y_m) + b (u - u_m) + c, so that the constant is c + (1 + sum a) y_m -
        sum b u_m.
        """
        orders = self.orders
        return np.concatenate(
            (
                np.full(orders.na, scaling.position_offset),
                np.full(orders.nb, -scaling.command_offset),
                [1.0],
            )
        )

    def _raw_deviation(
        self, deviation: FloatArray, covariance: FloatArray, scaling: ehsid.Scaling
    ) -> FloatArray:
        raw = deviation.copy()
        if self.orders.offset:
            weights = self._to_raw(scaling)
            raw[-1] = np.sqrt(max(float(weights @ covariance @ weights), 0.0))
        return raw

    def _scale(self, scaling: ehsid.Scaling) -> FloatArray:
        """Returns the factors from parameters in the units of the signals to scaled ones."""
        orders = self.orders
        return np.concatenate(
            (
                np.ones(orders.na),
                np.full(orders.nb, scaling.command_scale / scaling.position_scale),
                np.full(int(orders.offset), 1.0 / scaling.position_scale),
            )
        )


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
