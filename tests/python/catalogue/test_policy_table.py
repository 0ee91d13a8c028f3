# SPDX-License-Identifier: MIT
"""Recursions of the catalogue are those of the estimator, each with the policies that it takes."""

from __future__ import annotations

import pytest

import ehsid
from ehsid.harness.catalogue.parameters import METHODS, POLICIES, policies_of


def estimator(method: str, policy: str) -> ehsid.ArxEstimator:
    return ehsid.ArxEstimator(2, 2, 1, forgetting=POLICIES[policy].policy(), method=method)


@pytest.mark.parametrize("method", METHODS)
def test_a_recursion_takes_its_policies_and_no_other(method: str) -> None:
    for policy in POLICIES:
        if policy in policies_of(method):
            estimator(method, policy)
        else:
            with pytest.raises(ValueError, match=r"policy|policies|forgetting"):
                estimator(method, policy)
