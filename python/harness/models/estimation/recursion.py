# SPDX-License-Identifier: MIT
"""The settings of a recursive estimation, and its figures once it has run over a record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import ehsid

from ...base.arrays import FloatArray
from ..identification import ArxModel, ArxOrders, IdentificationError, IoData, fit_percent, simulate
from .result import Estimate
from .servo import ServoPath, estimate_servo

START_VARIANCE = 1e6  # of ArxEstimator
# Of ArxEstimator: largest relative deviation of what has settled, and size below which a scaled
# parameter is judged as if it had this one.
TOLERANCE, MAGNITUDE = 0.05, 0.1
# Number of equations per parameter that count as start-up.
START_EQUATIONS = 10


@dataclass(frozen=True)
class Recursion:
    """Settings of an estimator, the same for every record.

    Attributes
    ----------
    orders
        structure of the model, na and nb up to 6, nk up to 20. Without a constant term the model
        takes the mean command of the record for the one at which the output stands still.
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
        "rls", or for noise of the position sensor "riv".
    """

    orders: ArxOrders
    forgetting: ehsid.Forgetting
    reset: bool = True
    guards: ehsid.RlsOptions | None = None
    start_variance: float = START_VARIANCE
    dtype: str = "float32"
    method: str = "rls"

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
