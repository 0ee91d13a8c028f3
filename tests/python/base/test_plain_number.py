# SPDX-License-Identifier: MIT
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.base.numbers import plain_number


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (1652.4, 3, "1650"),
        (-1652.4, 3, "-1650"),
        (99960.0, 3, "100000"),
        (0.00312, 2, "0.0031"),
        (3.77, 3, "3.77"),
        (0.0, 3, "0"),
        (1.2e7, 2, "1.2e+07"),
        (2e-6, 2, "2e-06"),
        (float("inf"), 3, "inf"),
    ],
)
def test_a_number_is_written_for_people(value: float, digits: int, shown: str) -> None:
    assert plain_number(value, digits) == shown


@given(st.floats(1e-3, 1e5), st.integers(1, 6))
def test_there_is_no_exponent_in_the_middle(value: float, digits: int) -> None:
    text = plain_number(value, digits)
    assert "e" not in text
    assert float(text) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))
