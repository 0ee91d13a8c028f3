# SPDX-License-Identifier: MIT
"""Offline identification of ARX models: estimation, criteria, residual tests, choice of order.

>>> data = IoData.from_record(record, "command_v", "position_m")
>>> result = identify(data)
>>> print(result.reason)
"""

from ehsid.harness.identification.arx import ArxModel, fit_arx
from ehsid.harness.identification.candidates import Candidate, Rejected
from ehsid.harness.identification.criteria import (
    Criteria,
    aic,
    criteria,
    fit_percent,
    fpe,
    loss,
    mdl,
)
from ehsid.harness.identification.data import IoData
from ehsid.harness.identification.errors import (
    IdentificationError,
    TooFewSamplesError,
    UnexcitedError,
)
from ehsid.harness.identification.orders import ArxOrders
from ehsid.harness.identification.regression import Regression, least_squares, regression
from ehsid.harness.identification.residuals import (
    IndependenceTest,
    WhitenessTest,
    independence_test,
    whiteness_test,
)
from ehsid.harness.identification.selection import IdentificationResult, identify
from ehsid.harness.identification.simulation import Prediction, predict_one_step, simulate

__all__ = [
    "ArxModel",
    "ArxOrders",
    "Candidate",
    "Criteria",
    "IdentificationError",
    "IdentificationResult",
    "IndependenceTest",
    "IoData",
    "Prediction",
    "Regression",
    "Rejected",
    "TooFewSamplesError",
    "UnexcitedError",
    "WhitenessTest",
    "aic",
    "criteria",
    "fit_arx",
    "fit_percent",
    "fpe",
    "identify",
    "independence_test",
    "least_squares",
    "loss",
    "mdl",
    "predict_one_step",
    "regression",
    "simulate",
    "whiteness_test",
]
