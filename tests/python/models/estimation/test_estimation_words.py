# SPDX-License-Identifier: MIT
"""Advice, residuals and the state of an estimate in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ehsid
from ehsid.harness.catalogue.parameters import METHODS
from ehsid.harness.models.estimation import Estimate
from ehsid.harness.models.estimation.advice import (
    Advice,
    Setting,
    Trial,
    advice_words,
    not_white_words,
    servo_words,
    state_words,
)
from ehsid.harness.models.estimation.servo import ServoPath, ServoValue
from ehsid.harness.models.identification import ArxOrders

ESTIMATE = Estimate(
    ArxOrders(2, 2, 1), "Constant(lambda_=0.99)", "rls", np.zeros(4), np.ones(4), 0.0, 0.0,
    np.ones(4), 1000, 40, 1.0,
    90.0, 80.0, 0, False, False, 0, False, 100.0, None,
)  # fmt: skip


def test_advice_names_the_option_of_the_command_or_the_argument_in_python() -> None:
    trial = Trial("The delay is wrong.", Setting("--nk 2", "nk=2"), 91.234, residuals_white=False)
    advice = Advice((trial,), ("Take a longer record.",))
    command, lacks = advice_words(advice)
    assert "With `--nk 2` the estimate converges" in command
    assert "91.23 %" in command
    assert "still not white" in command
    assert lacks == "Take a longer record."
    assert "With `nk=2` the estimate converges" in advice_words(advice, python=True)[0]


@pytest.mark.parametrize("method", METHODS)
def test_each_recursion_has_reasons_for_coloured_residuals(method: str) -> None:
    words = not_white_words(replace(ESTIMATE, method=method))
    assert "(statistic 100, at most 22.5 expected)" in words
    assert "friction" in words


@pytest.mark.parametrize(
    ("settled", "converged", "told"),
    [
        (False, False, "not converged"),
        (True, False, "settled, not converged"),
        (True, True, "converged"),
    ],
)
def test_a_state_is_told_in_words(settled: bool, converged: bool, told: str) -> None:
    assert state_words(replace(ESTIMATE, settled=settled, converged=converged)) == told


@pytest.mark.parametrize("reason", [one for one in ehsid.TrustReason if one.name != "trusted"])
def test_each_reason_has_words(reason: ehsid.TrustReason) -> None:
    def value(name: str, why: ehsid.TrustReason) -> ServoValue:
        return ServoValue(name, "", np.ones(2), np.ones(2), np.array([True, False]), 0.5, why)

    trusted = value("K", ehsid.TrustReason.trusted)
    path = ServoPath(trusted, value("omega_n", reason), value("xi", reason), 1, 2)
    words, resets = servo_words(path)
    assert words.startswith("At the end omega_n and xi cannot be trusted: ")
    assert resets == "The model was lost and begun anew 2 times."
