# SPDX-License-Identifier: MIT
"""Orders and delays to try are read as users write them."""

from __future__ import annotations

import pytest

from ehsid.harness.models.identification.selection import parse_range


def test_a_range_has_its_upper_end() -> None:
    assert parse_range(" 2-5 ", "orders", 50) == range(2, 6)
    assert parse_range("3", "orders", 50) == range(3, 4)


@pytest.mark.parametrize("text", ["5-2", "", "two", "-1", "1-51", "2-", "1.5", "1,2"])
def test_what_is_no_range_is_refused_by_name(text: str) -> None:
    with pytest.raises(ValueError, match=r"orders '.*': expected a number or a range such as 2-5"):
        parse_range(text, "orders", 50)
