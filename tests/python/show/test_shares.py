# SPDX-License-Identifier: MIT
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.show.page import SPACE
from ehsid.harness.show.units import percent, percent_interval


def plain(text: str) -> str:
    return text.replace(SPACE, " ")


@pytest.mark.parametrize(
    ("share", "shown"),
    [
        (0.632, "63 %"),
        (0.0998, "10 %"),
        (0.0412, "4.1 %"),
        (0.00123, "0.12 %"),
        (-0.21, "-21 %"),
        (0.9998, "100 %"),
        (1.04, "104 %"),
        (0.0, "0 %"),
        (None, "–"),
        (math.nan, "–"),
    ],
)
def test_a_share_has_two_digits(share: float | None, shown: str) -> None:
    assert plain(percent(share)) == shown


@given(st.floats(0.0, 1.0))
def test_a_share_can_be_read_back(share: float) -> None:
    read = float(percent(share).removesuffix(f"{SPACE}%"))
    assert read == pytest.approx(100.0 * share, rel=0.051, abs=0.0051)


def test_an_interval_has_as_many_decimals_as_show_it() -> None:
    assert plain(percent_interval(Estimate(0.98, 0.96, 0.99))) == "98 % (96 to 99 %)"
    assert plain(percent_interval(Estimate(0.981, 0.975, 0.988))) == "98.1 % (97.5 to 98.8 %)"
