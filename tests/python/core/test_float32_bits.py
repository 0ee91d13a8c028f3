# SPDX-License-Identifier: MIT
"""Python's float32 results are those of C++: both are compared with the same table of hashes."""

import importlib.util
from types import ModuleType

import pytest
from sources import ROOT


@pytest.fixture(scope="module")
def golden() -> ModuleType:
    path = ROOT / "tests" / "golden" / "float32_bits.py"
    spec = importlib.util.spec_from_file_location("float32_bits", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_bits_are_those_of_the_table(golden: ModuleType) -> None:
    assert golden.hashes() == golden.table()


def test_every_policy_has_bits_of_its_own(golden: ModuleType) -> None:
    table = golden.table()
    assert list(table) == list(golden.POLICIES)
    assert len(set(table.values())) == len(table)
