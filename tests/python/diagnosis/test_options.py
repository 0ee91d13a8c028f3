# SPDX-License-Identifier: MIT
"""The options of a diagnosis, which every way to a diagnosis hands on as one value."""

from __future__ import annotations

from dataclasses import fields

import pytest

from ehsid.harness.diagnosis.options import DiagnosisChoices, DiagnosisOptions


def test_each_option_is_an_argument_of_the_python_interface() -> None:
    names = {one.name for one in fields(DiagnosisOptions)}
    assert set(DiagnosisChoices.__annotations__) == names


def test_an_effect_is_left_out_once() -> None:
    twice = DiagnosisOptions(["valve_lag", "load_force", "valve_lag"])
    assert twice.exclude == ("valve_lag", "load_force")


def test_an_unknown_effect_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ValueError, match=r"'valve_lg' is not known; did you mean 'valve_lag'\?"):
        DiagnosisOptions(("valve_lg",))
