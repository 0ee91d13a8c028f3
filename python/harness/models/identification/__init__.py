# SPDX-License-Identifier: MIT
"""Identifies ARX models offline: estimation, criteria, residual tests, choice of order.

>>> data = IoData.from_record(record, "command_v", "position_m")
>>> result = identify(data)
>>> print(result.reason)
"""

from .arx import ArxModel, fit_arx, regression
from .candidates import Candidate, Criteria, aic, criteria, fit_percent, fpe, loss, mdl
from .data import ArxOrders, IdentificationError, IoData, TooFewSamplesError, UnexcitedError
from .dynamics import (
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
from .preprocessing import Preprocessed, Preprocessing, preprocess
from .residuals import (
    Prediction,
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
    "Candidate",
    "Criteria",
    "EstimatedResponse",
    "FrequencyResponse",
    "IdentificationError",
    "IdentificationResult",
    "IoData",
    "Outliers",
    "PolesZeros",
    "Prediction",
    "Preprocessed",
    "Preprocessing",
    "Roots",
    "TooFewSamplesError",
    "UnexcitedError",
    "agreement",
    "aic",
    "criteria",
    "fit_arx",
    "fit_percent",
    "fpe",
    "frequency_response",
    "identify",
    "independence_test",
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
