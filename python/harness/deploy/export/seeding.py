# SPDX-License-Identifier: MIT
"""A configuration whose start is an offline model of a record."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.deploy.export.configuration import EstimatorConfiguration, Seed
from ehsid.harness.estimation import scaling_of
from ehsid.harness.identification import (
    ArxModel,
    ArxOrders,
    IdentificationError,
    IoData,
    fit_arx,
)

LEAST_INFLATION = 10.0
"""The covariance is true for white residuals and for the plant as it was on the day of the record.
Residuals of real records are coloured and the oil is warmer tomorrow, so it is trusted ten times
less; docs/export.md has what that costs and gains."""

MOST_SAMPLES = 100.0
"""However long the record, its model counts for no more samples than this: one that is wrong would
otherwise take as many new ones to outvote."""

VAGUE = 1e6
"""Variance to which a reset goes back."""

VAGUER = 100.0
"""Times the largest variance of the start, the least that counts as vague."""


@dataclass(frozen=True, eq=False)
class Export:
    """A seeded configuration and where it comes from.

    Attributes
    ----------
    configuration
        all settings.
    model
        offline model of the scaled record.
    inflation
        factor on its covariance.
    """

    configuration: EstimatorConfiguration
    model: ArxModel
    inflation: float

    @property
    def counts_for(self) -> float:
        """Samples of the record for which the start counts."""
        return self.model.n_rows / self.inflation


def configure_from_record(
    data: IoData,
    orders: ArxOrders,
    *,
    forgetting: ehsid.Forgetting,
    inflation: float | None = None,
    reset: bool = True,
) -> Export:
    """Identify offline over the whole record and start the estimator from the result.

    Scaled by the standard deviations of the record about its means, as `estimate` does. A reset
    goes back to a vague P, not to that of the offline model.

    Parameters
    ----------
    data
        input and output.
    orders
        structure; na, nb up to 6, nk up to 20.
    forgetting
        policy. One that forgets from the first sample on, forgets the seed too.
    inflation
        factor >= 1 on the covariance of the offline model; by default 10, or more for a long
        record, so that the model counts for 100 samples at most.
    reset
        restart lambda and P where the RMSE shows a change of the plant.

    Raises
    ------
    IdentificationError
        the record does not determine the model or its noise.
    ValueError
        inflation or structure out of range.
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
    configuration.estimator()  # refuses what the recursion does not take
    return Export(configuration, model, inflation)


def _in_float32(scaling: ehsid.Scaling) -> ehsid.Scaling:
    """As the estimator will have it, so that the offline model is of the same scaled signals."""
    return ehsid.Scaling(
        command_scale=float(np.float32(scaling.command_scale)),
        position_scale=float(np.float32(scaling.position_scale)),
        command_offset=float(np.float32(scaling.command_offset)),
        position_offset=float(np.float32(scaling.position_offset)),
    )


def _units(orders: ArxOrders, scaling: ehsid.Scaling) -> npt.NDArray[np.float64]:
    """From scaled parameters to those in the units of the signals, shape (n,)."""
    b = scaling.position_scale / scaling.command_scale
    return np.array(
        [1.0] * orders.na + [b] * orders.nb + [scaling.position_scale] * int(orders.offset)
    )
