# SPDX-License-Identifier: MIT
"""Makes an estimator configuration that starts from an offline model of a record."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

import ehsid

from ..models.estimation import scaling_of
from ..models.identification import ArxModel, ArxOrders, IdentificationError, IoData, fit_arx
from .configuration import EstimatorConfiguration, Seed

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
