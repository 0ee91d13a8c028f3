# SPDX-License-Identifier: MIT
"""Python's float32 results are those of C++: both are compared with the same table of hashes."""

from types import SimpleNamespace

import pytest
from sources import ROOT, loaded


@pytest.fixture(scope="module")
def golden() -> SimpleNamespace:
    return loaded(ROOT / "tests" / "golden" / "float32_bits.py")


def test_bits_are_those_of_the_table(golden: SimpleNamespace) -> None:
    assert golden.hashes() == golden.table()


def test_every_policy_has_bits_of_its_own(golden: SimpleNamespace) -> None:
    table = golden.table()
    assert list(table) == list(golden.POLICIES)
    assert len(set(table.values())) == len(table)
