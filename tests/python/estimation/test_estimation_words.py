# SPDX-License-Identifier: MIT
"""What to try depends on why an estimate has not converged; the structure fits the recursion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ehsid.harness.catalogue.policies import METHODS
from ehsid.harness.estimation import Estimate, structure
from ehsid.harness.estimation.words import not_white_words, what_to_try
from ehsid.harness.identification import ArxOrders

ESTIMATE = Estimate(
    ArxOrders(2, 2, 1), "Constant(lambda_=0.99)", "rls", np.zeros(4), np.ones(4), 1000, 40, 1.0,
    90.0, 80.0, 0, False, 0, False, 100.0,
)  # fmt: skip


def test_a_converged_estimate_needs_nothing() -> None:
    assert what_to_try(replace(ESTIMATE, converged=True, resets=3, skipped=900)) == []


def test_reasons_are_named_where_they_apply() -> None:
    plain = " ".join(what_to_try(ESTIMATE))
    assert "forget more slowly" in plain
    for words, changed in (
        ("switch the reset off", replace(ESTIMATE, resets=2)),
        ("501 of 1000 samples carried no information", replace(ESTIMATE, skipped=501)),
        ("fewer coefficients", replace(ESTIMATE, orders=ArxOrders(3, 3, 1))),
    ):
        assert words not in plain
        assert words in " ".join(what_to_try(changed))


@pytest.mark.parametrize("method", METHODS)
def test_each_recursion_has_reasons_for_coloured_residuals(method: str) -> None:
    words = not_white_words(replace(ESTIMATE, method=method))
    assert "(statistic 100, at most 22.5 expected)" in words
    assert "friction" in words


@pytest.mark.parametrize("method", METHODS)
def test_running_models_have_a_constant_term(method: str) -> None:
    assert structure(3, 2, 4, method) == ArxOrders(3, 2, 4, offset=method != "rls")
