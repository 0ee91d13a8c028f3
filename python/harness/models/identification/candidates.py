# SPDX-License-Identifier: MIT
"""Estimates one ARX structure on the first part of the data and judges it on the second."""

from __future__ import annotations

from dataclasses import dataclass

from ...base.arrays import FloatArray
from .arx import ArxModel, fit_arx
from .criteria import Criteria, criteria, fit_percent
from .data import IoData
from .errors import UnexcitedError
from .orders import ArxOrders
from .simulation import predict_one_step, simulate


@dataclass(frozen=True, eq=False)
class Candidate:
    """An estimated structure and its figures of merit.

    Attributes
    ----------
    orders
        structure of the model.
    model
        model estimated on the estimation part.
    one_step_fit_percent
        fit of the one-step prediction on the validation part, in percent.
    simulation_fit_percent
        fit of the free run on the validation part, in percent; -inf if the run diverges.
    estimation, validation
        loss, FPE, AIC and MDL of the one-step residuals on the estimation and validation part.
        The theory of Akaike and Rissanen applies to `estimation`. The validation loss can be
        compared without a penalty; its penalised forms are given because tables quote them.
    """

    orders: ArxOrders
    model: ArxModel
    one_step_fit_percent: float
    simulation_fit_percent: float
    estimation: Criteria
    validation: Criteria


@dataclass(frozen=True)
class Rejected:
    """A structure that the estimation data do not determine, its parameters, and the reason."""

    orders: ArxOrders
    parameters: tuple[str, ...]
    why: str


def judge(
    orders: ArxOrders, estimation: IoData, validation: IoData, *, remove_means: bool, skip: int
) -> tuple[Candidate, FloatArray] | Rejected:
    """Estimates a structure; returns it with its one-step residuals on the validation part.

    Parameters
    ----------
    orders
        structure to estimate.
    estimation
        part of the data on which the model is estimated.
    validation
        part of the data on which the model is judged.
    remove_means
        see `fit_arx`; the means are those of the estimation part.
    skip
        samples left out at the start of each segment, common to all structures, so that all are
        judged on the same samples.

    Raises
    ------
    TooFewSamplesError
        the estimation part has fewer equations than the structure has parameters, or a part has no
        equation at all.
    """
    try:
        model = fit_arx(estimation, orders, remove_means=remove_means, skip=skip)
    except UnexcitedError as error:
        return Rejected(orders, error.parameters, error.why)
    d = orders.n_parameters
    fitted = predict_one_step(model, estimation, skip=skip)
    ahead = predict_one_step(model, validation, skip=skip)
    free = simulate(model, validation, skip=skip)
    candidate = Candidate(
        orders=orders,
        model=model,
        one_step_fit_percent=fit_percent(ahead.measured, ahead.predicted),
        simulation_fit_percent=fit_percent(free.measured, free.predicted),
        estimation=criteria(fitted.residual, d),
        validation=criteria(ahead.residual, d),
    )
    return candidate, ahead.residual
