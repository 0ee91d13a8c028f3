# SPDX-License-Identifier: MIT
"""All settings of a float32 estimator, and how they start from an offline model of a record."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

import ehsid

from ..base.numbers import FloatArray
from ..models.estimation import scaling_of
from ..models.identification import ArxModel, ArxOrders, IdentificationError, IoData, fit_arx


@dataclass(frozen=True, eq=False)
class Seed:
    """Initial estimate of an estimator with n parameters."""

    theta: FloatArray
    """Parameters, shape (n,), in the units of the signals about the offsets of the scaling."""
    u: FloatArray
    d: FloatArray
    """Factors of the covariance P = u diag(d) u' of the scaled parameters, in units of sigma^2; u
    has shape (n, n) and is unit upper triangular, d has shape (n,) and is > 0."""
    noise_variance: float
    """sigma^2 in squared units of the position, >= 0; 0 if it is unknown."""

    @classmethod
    def from_covariance(
        cls, theta: npt.ArrayLike, covariance: npt.ArrayLike, noise_variance: float
    ) -> Seed:
        """Factors a covariance P in double precision and returns the seed.

        In float32 it would not always be possible to distinguish P from a singular matrix.

        Parameters
        ----------
        theta
            parameters, shape (n,), in the units of the signals.
        covariance
            P, shape (n, n), of the scaled parameters in units of sigma^2; positive definite.
        noise_variance
            sigma^2 in squared units of the position.

        Raises
        ------
        IdentificationError
            P is not positive definite.
        """
        # In reversed order of rows and columns, P = L L' becomes P = R R' with R upper triangular.
        turned = np.asarray(covariance, dtype=np.float64)[::-1, ::-1]
        try:
            r = np.linalg.cholesky(turned)[::-1, ::-1]
        except np.linalg.LinAlgError as error:
            raise IdentificationError(
                "the covariance to start from is not positive definite: the record does not "
                "determine all parameters; excite more or take a lower order"
            ) from error
        size = np.diag(r)
        u = np.triu(r / size, 1) + np.eye(size.size)
        return cls(np.asarray(theta, dtype=np.float64), u, size**2, noise_variance)

    @property
    def variances(self) -> FloatArray:
        """Diagonal of P, shape (n,)."""
        return (self.u**2) @ self.d


@dataclass(frozen=True, eq=False)
class EstimatorConfiguration:
    """Complete configuration of a float32 estimator before its first sample.

    The numbers are double precision. They are rounded once to float32, both in the Python estimator
    and in the header.

    Attributes
    ----------
    scaling, forgetting, rls, convergence
        settings as `ehsid.ArxEstimator` takes them.
    """

    orders: ArxOrders
    """Structure of the ARX model; na, nb up to 6, nk up to 20."""
    scaling: ehsid.Scaling = field(default_factory=ehsid.Scaling)
    forgetting: ehsid.Forgetting = field(default_factory=ehsid.FRatio)
    rls: ehsid.RlsOptions = field(default_factory=ehsid.RlsOptions)
    reset: ehsid.RmseResetOptions | None = field(default_factory=ehsid.RmseResetOptions)
    """Settings of the reset; with None the estimator never resets."""
    convergence: ehsid.ConvergenceOptions = field(default_factory=ehsid.ConvergenceOptions)
    variance0: float = 1e6
    """Diagonal of the P that a reset restores, of the scaled parameters, in units of sigma^2."""
    input_limit: float = 1e4
    """Largest plausible absolute value of a scaled signal."""
    seed: Seed | None = None
    """Initial estimate; with None the estimator starts from zero and `variance0`."""

    def estimator(self, dtype: str = "float32") -> ehsid.ArxEstimator:
        """Returns a new estimator of this precision with these settings, before its first sample.

        Raises
        ------
        ValueError
            the structure is outside the compiled range, or a number is outside its range in
            float32.
        """
        made = ehsid.ArxEstimator(
            self.orders.na,
            self.orders.nb,
            self.orders.nk,
            offset=self.orders.offset,
            forgetting=self.forgetting,
            scaling=self.scaling,
            rls=self.rls,
            reset=self.reset,
            convergence=self.convergence,
            variance0=[self.variance0] * self.orders.n_parameters,
            input_limit=self.input_limit,
            dtype=dtype,
        )
        if self.seed is not None:
            made.seed(self.seed.theta, self.seed.u, self.seed.d, self.seed.noise_variance)
        return made


LEAST_INFLATION = 10.0
"""Smallest default factor on the covariance of the offline model. The covariance holds for white
residuals and for the plant on the day of the record. Residuals of real records are coloured, and
the oil temperature changes; docs/evidence/export.md has the cost and the gain of the factor."""

MOST_SAMPLES = 100.0
"""Largest number of samples for which the model counts by default, however long the record is.
Otherwise a wrong model of a long record would need as many new samples to be corrected."""

VAGUE = 1e6
"""Smallest variance that a reset restores, of the scaled parameters, in units of sigma^2."""

VAGUER = 100.0
"""A variance counts as vague if it is at least this many times the largest variance of the seed."""


@dataclass(frozen=True, eq=False)
class Export:
    """A seeded configuration and the offline model from which it was made."""

    configuration: EstimatorConfiguration
    """All settings of the estimator."""
    model: ArxModel
    """Offline model of the scaled record."""
    inflation: float
    """Factor on the covariance of the model."""

    @property
    def counts_for(self) -> float:
        """Number of samples of the record for which the initial estimate counts."""
        return self.model.n_rows / self.inflation


def configure_from_record(
    data: IoData,
    orders: ArxOrders,
    *,
    forgetting: ehsid.Forgetting,
    inflation: float | None = None,
    reset: bool = True,
) -> Export:
    """Identifies a model offline over the whole record and makes it the start of the estimator.

    The signals are taken about their means and scaled by their standard deviations in the record,
    as `estimate` does. A reset restores a vague P, not the P of the offline model.

    Parameters
    ----------
    data
        input and output of the record.
    orders
        structure of the ARX model; na, nb up to 6, nk up to 20.
    forgetting
        forgetting policy. A policy that forgets from the first sample on also forgets the seed.
    inflation
        factor >= 1 on the covariance of the offline model; by default 10, or more for a long
        record, so that the model counts for at most 100 samples.
    reset
        whether to restart lambda and P when the RMSE shows a change of the plant.

    Raises
    ------
    IdentificationError
        the record does not determine the model or its noise.
    ValueError
        the inflation or the structure is out of range.
    """
    if inflation is not None and not (np.isfinite(inflation) and inflation >= 1.0):
        raise ValueError(f"inflation {inflation:g}: expected a finite number of at least 1")
    scaling = _in_float32(scaling_of(data))
    scaled = replace(
        data,
        u=(data.u - scaling.command_offset) / scaling.command_scale,
        y=(data.y - scaling.position_offset) / scaling.position_scale,
    )
    model = fit_arx(scaled, orders)
    if not model.noise_variance > 0.0:
        raise IdentificationError(
            f"the {model.n_rows} equations of the record leave no residual to {orders}: nothing "
            "tells how far to trust the model; give a longer record"
        )
    if inflation is None:
        inflation = max(LEAST_INFLATION, model.n_rows / MOST_SAMPLES)
    seed = Seed.from_covariance(
        model.theta * _units(orders, scaling),
        inflation * model.covariance / model.noise_variance,
        model.noise_variance * scaling.position_scale**2,
    )
    configuration = EstimatorConfiguration(
        orders,
        scaling=scaling,
        forgetting=forgetting,
        reset=ehsid.RmseResetOptions() if reset else None,
        variance0=max(VAGUE, VAGUER * float(seed.variances.max())),
        seed=seed,
    )
    configuration.estimator()  # raises ValueError for settings that the recursion does not accept
    return Export(configuration, model, inflation)


def _in_float32(scaling: ehsid.Scaling) -> ehsid.Scaling:
    """Rounds a scaling to float32, as in the estimator.

    The offline model then belongs to the same scaled signals.
    """
    return ehsid.Scaling(
        command_scale=float(np.float32(scaling.command_scale)),
        position_scale=float(np.float32(scaling.position_scale)),
        command_offset=float(np.float32(scaling.command_offset)),
        position_offset=float(np.float32(scaling.position_offset)),
    )


def _units(orders: ArxOrders, scaling: ehsid.Scaling) -> npt.NDArray[np.float64]:
    """Factors from scaled parameters to parameters in the units of the signals, shape (n,)."""
    b = scaling.position_scale / scaling.command_scale
    return np.array(
        [1.0] * orders.na + [b] * orders.nb + [scaling.position_scale] * int(orders.offset)
    )
