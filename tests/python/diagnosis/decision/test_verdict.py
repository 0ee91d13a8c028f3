# SPDX-License-Identifier: MIT
"""What counts as agreement of the simulator as configured with the machine."""

from __future__ import annotations

import pytest

from ehsid.harness.diagnosis.deciding import LEAST_GAIN, NEAR_FLOOR, NEAR_GAP
from ehsid.harness.diagnosis.decision.verdict import (
    agrees_as_configured,
    is_gained,
    largest_noise,
)


@pytest.mark.parametrize(
    ("nominal", "floor", "agrees"),
    [
        (0.5 * NEAR_GAP, 0.01 * NEAR_GAP, True),  # small, but far above the noise
        (4.0 * NEAR_GAP, 5.0 * NEAR_GAP / NEAR_FLOOR, True),  # large, but so is the noise
        (0.5 * NEAR_GAP, NEAR_GAP, True),
        (4.0 * NEAR_GAP, 3.0 * NEAR_GAP / NEAR_FLOOR, False),
    ],
)
def test_a_gap_near_the_noise_or_a_small_one_is_agreement(
    nominal: float, floor: float, agrees: bool
) -> None:
    assert agrees_as_configured(nominal, floor) is agrees


@pytest.mark.parametrize(
    ("calibrated", "noise"),
    [
        (0.9, 0.4),  # much stays: the noise is within its bounds
        (0.02, 0.02),  # the noise is within what stays
        (0.001, 0.01),  # it cannot be below what is known of it
    ],
)
def test_noise_is_no_larger_than_what_fitted_values_leave(calibrated: float, noise: float) -> None:
    assert largest_noise(calibrated, (0.01, 0.4)) == noise


def test_a_gain_counts_from_the_least_on() -> None:
    assert is_gained(LEAST_GAIN)
    assert not is_gained(0.99 * LEAST_GAIN)
