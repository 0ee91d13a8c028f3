# SPDX-License-Identifier: MIT
"""Estimates one ARX structure on the first part of the data and judges it on the second.

Criteria for the comparison of models.

Sources: H. Akaike, "Fitting autoregressive models for prediction", Ann. Inst. Stat. Math. 21, 1969
(FPE), and "A new look at the statistical model identification", IEEE Trans. Autom. Control 19(6),
1974 (AIC); J. Rissanen, "Modeling by shortest data description", Automatica 14(5), 1978 (MDL);
L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, ch. 7 and 16.
In this module N is the number of residuals, d the number of parameters and V the loss.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base.numbers import FloatArray
from .arx import ArxModel, fit_arx
from .data import ArxOrders, IoData, UnexcitedError
from .residuals import predict_one_step, simulate

# A simulation with a fit below this diverges: its error is ten thousand times the motion.
DIVERGES_PERCENT = -1e6
DIVERGES = "diverges"


def loss(residual: FloatArray) -> float:
    """Loss V = (1/N) sum of squared residuals, in squared units of the output.

    `residual` has the shape (N,).
    """
    return float(np.mean(residual**2))


def fpe(loss_value: float, n_rows: int, n_parameters: int) -> float:
    """Akaike's final prediction error, V (1 + d/N) / (1 - d/N) (Akaike 1969); inf for d >= N."""
    if n_parameters >= n_rows:
        return math.inf
    share = n_parameters / n_rows
    return loss_value * (1.0 + share) / (1.0 - share)


def aic(loss_value: float, n_rows: int, n_parameters: int) -> float:
    """Akaike's information criterion per sample, ln V + 2 d/N (Akaike 1974); -inf for V = 0."""
    return _log(loss_value) + 2.0 * n_parameters / n_rows


def mdl(loss_value: float, n_rows: int, n_parameters: int) -> float:
    """Minimum description length as a loss, V (1 + d ln(N)/N) (Rissanen 1978, to first order)."""
    return loss_value * (1.0 + n_parameters * math.log(n_rows) / n_rows)


def fit_percent(measured: FloatArray, predicted: FloatArray) -> float:
    """Fit 100 (1 - |y - y_hat| / |y - mean(y)|) in percent, Euclidean norms over all samples.

    100 is a perfect fit; 0 is as good as the mean of the output; a negative fit is worse than the
    mean. The fit is -inf if the prediction diverges or overflows, and NaN if the measured output is
    constant.

    Parameters
    ----------
    measured
        measured output y, shape (N,).
    predicted
        predicted output y_hat, shape (N,), in the same unit.
    """
    spread = float(np.linalg.norm(measured - np.mean(measured)))
    if spread == 0.0:
        return math.nan
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(np.linalg.norm(measured - predicted))
    return 100.0 * (1.0 - error / spread) if math.isfinite(error) else -math.inf


def diverges(simulation_fit_percent: float) -> bool:
    """Whether a simulation with this fit grows without end, so that its fit says nothing more."""
    return simulation_fit_percent < DIVERGES_PERCENT


def simulation_words(simulation_fit_percent: float) -> str:
    """Returns the fit of a simulation as a clause."""
    if diverges(simulation_fit_percent):
        return "the simulation diverges"
    return f"simulation fit {simulation_fit_percent:.2f} %"


def simulation_cell(simulation_fit_percent: float) -> str:
    """Returns the fit of a simulation in per cent for a table."""
    if diverges(simulation_fit_percent):
        return DIVERGES
    return f"{simulation_fit_percent:.2f}"


@dataclass(frozen=True)
class Criteria:
    """Criteria of one model on one set of data: N, V, FPE, AIC and MDL."""

    n_rows: int
    loss: float
    fpe: float
    aic: float
    mdl: float


def criteria(residual: FloatArray, n_parameters: int) -> Criteria:
    """Returns all criteria of a model with d parameters from its one-step residuals, shape (N,)."""
    n, v = residual.size, loss(residual)
    return Criteria(n, v, fpe(v, n, n_parameters), aic(v, n, n_parameters), mdl(v, n, n_parameters))


def _log(value: float) -> float:
    return math.log(value) if value > 0.0 else -math.inf


@dataclass(frozen=True, eq=False)
class Candidate:
    """An estimated structure and its figures of merit."""

    orders: ArxOrders
    """Structure of the model."""
    model: ArxModel
    """Model estimated on the estimation part."""
    one_step_fit_percent: float
    """Fit of the one-step prediction on the validation part, in percent."""
    simulation_fit_percent: float
    """Fit of the free run on the validation part, in percent; -inf if the run diverges."""
    estimation: Criteria
    validation: Criteria
    """Loss, FPE, AIC and MDL of the one-step residuals on the estimation and validation part. The
    theory of Akaike and Rissanen applies to `estimation`. The validation loss can be compared
    without a penalty; its penalised forms are given because tables quote them."""


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
