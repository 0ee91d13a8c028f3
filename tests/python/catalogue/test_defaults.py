# SPDX-License-Identifier: MIT
"""A default is one, whichever door: C++, Python, commands, header, workbench."""

from __future__ import annotations

import inspect
from dataclasses import fields
from importlib import import_module
from typing import Any

import pytest

import ehsid
from ehsid.harness.catalogue.parameters import (
    POLICIES,
    RECORD_POLICY,
    SERVO_ORDERS,
    TARGET_POLICY,
)
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.models.estimation.recursion import START_VARIANCE, Recursion
from ehsid.harness.models.identification import ArxOrders
from ehsid.hil.plan import THIRD_ORDER
from ehsid.workbench.live.settings import LiveSettings
from ehsid.workbench.session import ModelChoice

ORDERS = dict(zip(("na", "nb", "nk"), SERVO_ORDERS, strict=True))
# Of a command or function that reads a record, and of one for a target.
RECORD = ORDERS | {"offset": True, "forgetting": RECORD_POLICY, "method": "rls", "reset": True}
TARGET = {"forgetting": TARGET_POLICY}


def defaults(function: Any) -> dict[str, Any]:
    """Returns the defaults of a function; those of options as plain values."""
    return {
        name: getattr(one.default, "value", one.default)
        for name, one in inspect.signature(function).parameters.items()
    }


def command(module: str, name: str) -> Any:
    return getattr(import_module(f"ehsid.{module}"), name)


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (ehsid.estimate, RECORD | {"start_variance": START_VARIANCE}),
        (
            command("harness.cli.estimate", "estimate_command"),
            RECORD | {"start_variance": START_VARIANCE},
        ),
        (command("harness.cli.export", "export_command"), TARGET | {"offset": True, "reset": True}),
        (command("hil.cli.hil", "hil_command"), TARGET),
    ],
)
def test_functions_and_commands(function: Any, expected: dict[str, Any]) -> None:
    found = defaults(function)
    assert {name: found[name] for name in expected} == expected


def test_workbench() -> None:
    choice = ModelChoice()
    found = {name: getattr(choice, name) for name in ("na", "nb", "nk", "method", "reset")}
    assert found == {name: RECORD[name] for name in found}
    assert choice.policy == RECORD_POLICY
    assert LiveSettings().forgetting == TARGET_POLICY


def test_recursion_of_a_record() -> None:
    found = {one.name: one.default for one in fields(Recursion)}
    expected = {
        "reset": RECORD["reset"],
        "method": RECORD["method"],
        "start_variance": START_VARIANCE,
        "guards": None,
        "dtype": "float32",
    }
    assert {name: found[name] for name in expected} == expected


@pytest.mark.parametrize("offset", [False, True])
def test_exported_header_and_target_have_the_settings_of_cpp(offset: bool) -> None:
    """A snapshot has the policy, and a checksum over every setting."""
    cpp = ehsid.ArxEstimator(*SERVO_ORDERS, offset=offset)  # every default is that of the template
    header = EstimatorConfiguration(ArxOrders(*SERVO_ORDERS, offset=offset))
    assert header.estimator().save() == cpp.save()
    named = POLICIES[TARGET_POLICY].policy()
    assert ehsid.ArxEstimator(*SERVO_ORDERS, offset=offset, forgetting=named).save() == cpp.save()
    other = ehsid.ArxEstimator(*SERVO_ORDERS, offset=offset, forgetting=ehsid.Exponential())
    assert other.save() != cpp.save()
    assert ArxOrders(*SERVO_ORDERS, offset=True) == THIRD_ORDER


def test_start_of_a_record_is_that_of_cpp() -> None:
    cpp = ehsid.ArxEstimator(*SERVO_ORDERS)
    n = cpp.n
    same = ehsid.ArxEstimator(*SERVO_ORDERS, variance0=[START_VARIANCE] * n, input_limit=1e4)
    assert same.save() == cpp.save()
    assert EstimatorConfiguration(ArxOrders(*SERVO_ORDERS)).variance0 == START_VARIANCE
