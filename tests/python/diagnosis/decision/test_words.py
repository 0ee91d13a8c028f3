# SPDX-License-Identifier: MIT
"""Gaps in words have two digits, also where the last one is a zero."""

from __future__ import annotations

import pytest

from ehsid.harness.diagnosis.decision.effect_selection import percent
from ehsid.harness.show import units


@pytest.mark.parametrize("gap", [0.0, 0.0078, 0.01, 0.00995, 0.0994, 0.0998, 0.12, 0.994, 1.71])
def test_a_gap_has_the_digits_that_it_has_in_the_tables(gap: float) -> None:
    assert percent(gap) == units.percent(gap).replace(units.SPACE, " ")


def test_a_tiny_gap_keeps_two_digits() -> None:
    assert percent(0.000012) == "0.0012 %"
