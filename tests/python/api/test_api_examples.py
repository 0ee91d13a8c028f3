# SPDX-License-Identifier: MIT
"""The examples in the docstrings say what happens."""

import doctest
from importlib import import_module

import pytest
from sources import ROOT

import ehsid

FUNCTIONS = ("diagnose", "estimate", "hunt", "identify", "record", "rig", "simulate", "watch")


@pytest.mark.parametrize("module", FUNCTIONS)
def test_examples_run(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    outcome = doctest.testmod(import_module(f"ehsid.harness.api.{module}"))
    assert outcome.attempted >= 2
    assert outcome.failed == 0


def test_every_public_name_is_in_a_module_with_an_example() -> None:
    assert {module for name, module in ehsid._LAZY.items() if name != "Record"} == set(FUNCTIONS)
