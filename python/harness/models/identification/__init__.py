# SPDX-License-Identifier: MIT
"""Identifies ARX models offline: estimation, criteria, residual tests, choice of order.

>>> data = IoData.from_record(record, "command_v", "position_m")
>>> result = identify(data)
>>> print(result.reason)
"""

from .arx import ArxModel, Regression, fit_arx, least_squares, regression
from .candidates import Candidate, Criteria, Rejected, aic, criteria, fit_percent, fpe, loss, mdl
from .data import ArxOrders, IdentificationError, IoData, TooFewSamplesError, UnexcitedError
from .dynamics import (
    Cancellation,
    PolesZeros,
    Roots,
    nearest_cancellation,
    poles_zeros,
    stability_distance,
)
from .frequency import (
    Agreement,
    EstimatedResponse,
    FrequencyResponse,
    agreement,
    frequency_response,
    power_band,
    response_grid,
)
from .outliers import Outliers, replace_outliers
from .preprocessing import Preprocessed, Preprocessing, SignalReport, preprocess
from .residuals import (
    IndependenceTest,
    Prediction,
    WhitenessTest,
    independence_test,
    predict_one_step,
    simulate,
    whiteness_test,
)
from .selection import IdentificationResult, identify

__all__ = [
    "Agreement",
    "ArxModel",
    "ArxOrders",
    "Cancellation",
    "Candidate",
    "Criteria",
    "EstimatedResponse",
    "FrequencyResponse",
    "IdentificationError",
    "IdentificationResult",
    "IndependenceTest",
    "IoData",
    "Outliers",
    "PolesZeros",
    "Prediction",
    "Preprocessed",
    "Preprocessing",
    "Regression",
    "Rejected",
    "Roots",
    "SignalReport",
    "TooFewSamplesError",
    "UnexcitedError",
    "WhitenessTest",
    "agreement",
    "aic",
    "criteria",
    "fit_arx",
    "fit_percent",
    "fpe",
    "frequency_response",
    "identify",
    "independence_test",
    "least_squares",
    "loss",
    "mdl",
    "nearest_cancellation",
    "poles_zeros",
    "power_band",
    "predict_one_step",
    "preprocess",
    "regression",
    "replace_outliers",
    "response_grid",
    "simulate",
    "stability_distance",
    "whiteness_test",
]
