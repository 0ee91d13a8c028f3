# SPDX-License-Identifier: MIT
"""What counts as agreement of the simulator as configured with the machine."""

from __future__ import annotations

import pytest

from ehsid.harness.diagnosis.deciding import LEAST_GAIN, NEAR_FLOOR, NEAR_GAP
from ehsid.harness.diagnosis.decision.verdict import agrees_as_configured, is_gained


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


def test_a_gain_counts_from_the_least_on() -> None:
    assert is_gained(LEAST_GAIN)
    assert not is_gained(0.99 * LEAST_GAIN)
