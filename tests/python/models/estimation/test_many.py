# SPDX-License-Identifier: MIT
"""estimate_all(): each record as it is estimated alone, bit for bit, whatever the others are."""

from dataclasses import replace

import model16
import numpy as np
import policies
import pytest

import ehsid
from ehsid.harness.models.estimation import Estimate, Recursion, estimate, estimate_all
from ehsid.harness.models.identification import ArxOrders, IdentificationError, IoData


def records() -> list[IoData]:
    """Records of unequal lengths, some in segments; one is longer than a chunk of the bank."""
    found = []
    for seed, size in enumerate((700, 4500, 300, 700, 1201, 129)):
        u, y = model16.signals(seed, size)
        data = IoData.from_arrays(3.0 + 2.0 * u, 0.01 * y - 0.5)
        if seed % 2:
            data = replace(data, segments=(slice(5, size // 3), slice(size // 3 + 9, size)))
        found.append(data)
    return found


def assert_same(found: list[Estimate | IdentificationError], recursion: Recursion) -> None:
    for one, data in zip(found, records(), strict=True):
        alone = estimate(data, **vars(recursion))
        assert isinstance(one, Estimate)
        assert one.to_dict() == alone.to_dict()
        assert one.theta.tobytes() == alone.theta.tobytes()
        assert one.standard_deviation.tobytes() == alone.standard_deviation.tobytes()
        assert one.n_samples == alone.status.size


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("name", policies.NAMES)
def test_every_record_is_estimated_as_alone(name: str, dtype: str) -> None:
    recursion = Recursion(ArxOrders(2, 3, 1), policies.PAIRS[name].compiled, dtype=dtype)
    assert_same(estimate_all(records(), recursion), recursion)


def test_a_method_without_a_bank_gives_the_same_as_alone() -> None:
    forgetting = ehsid.Exponential(lambda0=0.995, lambda_initial=0.98)
    recursion = Recursion(ArxOrders(1, 2, 1, offset=True), forgetting, method="riv")
    assert_same(estimate_all(records(), recursion), recursion)


def test_every_setting_reaches_the_estimators() -> None:
    textbook = Recursion(
        ArxOrders(1, 1, 2, offset=True),
        ehsid.Constant(0.99),
        reset=False,
        guards=ehsid.RlsOptions.textbook(),
        start_variance=10.0,
    )
    assert_same(estimate_all(records(), textbook), textbook)


def test_a_record_that_cannot_be_used_leaves_the_others_as_they_are() -> None:
    recursion = Recursion(ArxOrders(3, 3, 1), ehsid.Exponential())
    good = records()[:2]
    constant = IoData.from_arrays(np.ones(500), model16.signals(1, 500)[1])
    short = IoData.from_arrays(*model16.signals(1, 100))
    found = estimate_all([good[0], constant, short, good[1]], recursion)
    assert "u is constant" in str(found[1])
    assert "100 samples leave 97 equations for 6" in str(found[2])
    for one, data in zip((found[0], found[3]), good, strict=True):
        assert isinstance(one, Estimate)
        assert one.to_dict() == estimate(data, **vars(recursion)).to_dict()


def test_of_no_usable_record_there_are_only_errors() -> None:
    recursion = Recursion(ArxOrders(3, 3, 1), ehsid.Exponential())
    assert estimate_all([], recursion) == []
    constant = IoData.from_arrays(np.ones(500), np.zeros(500))
    assert isinstance(estimate_all([constant], recursion)[0], IdentificationError)


def test_settings_that_do_not_fit_each_other_are_refused() -> None:
    recursion = Recursion(ArxOrders(7, 3, 1), ehsid.Exponential())
    with pytest.raises(ValueError, match="na must be in"):
        estimate_all(records(), recursion)
