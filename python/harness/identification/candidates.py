# SPDX-License-Identifier: MIT
"""One ARX structure, estimated on one half of the data and judged on the other."""

from __future__ import annotations

from dataclasses import dataclass

from ehsid.harness.arrays import FloatArray
from ehsid.harness.identification.arx import ArxModel, fit_arx
from ehsid.harness.identification.criteria import Criteria, criteria, fit_percent
from ehsid.harness.identification.data import IoData
from ehsid.harness.identification.errors import UnexcitedError
from ehsid.harness.identification.orders import ArxOrders
from ehsid.harness.identification.simulation import predict_one_step, simulate


@dataclass(frozen=True, eq=False)
class Candidate:
    """An estimated structure and its figures.

    Attributes
    ----------
    orders
        structure.
    model
        estimated on the first part.
    one_step_fit_percent
        fit of the one-step prediction on the validation part.
    simulation_fit_percent
        fit of the free run on the validation part; -inf if it diverges.
    estimation, validation
        loss, FPE, AIC and MDL of the one-step residuals on either part.
        Akaike's and Rissanen's theory is about `estimation`; the validation loss needs no
        penalty to be compared, its penalised forms are given because tables quote them.
    """

    orders: ArxOrders
    model: ArxModel
    one_step_fit_percent: float
    simulation_fit_percent: float
    estimation: Criteria
    validation: Criteria


@dataclass(frozen=True)
class Rejected:
    """A structure that the estimation data do not determine, and why."""

    orders: ArxOrders
    parameters: tuple[str, ...]
    why: str


def judge(
    orders: ArxOrders, estimation: IoData, validation: IoData, *, remove_means: bool, skip: int
) -> tuple[Candidate, FloatArray] | Rejected:
    """Estimate a structure; give its figures and its one-step residuals on the validation part.

    Parameters
    ----------
    orders
        structure.
    estimation
        part the model is estimated on.
    validation
        part it is judged on.
    remove_means
        see `fit_arx`; the means are those of the estimation part.
    skip
        common to all structures, so that all are judged on the same samples.

    Raises
    ------
    TooFewSamplesError
        a part has fewer equations than the structure has parameters.
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
