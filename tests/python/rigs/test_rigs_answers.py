# SPDX-License-Identifier: MIT
"""A rig of answers: what is missing, unreadable or contradictory is told by its name."""

from __future__ import annotations

import pytest

from ehsid.harness.rigs import parse_rig
from ehsid.harness.rigs.questions import answered, rig_file_text

ANSWERS = {
    "bore": "63 mm",
    "rod": "35",
    "stroke": "0,3 m",
    "supply": "120 bar",
    "rated-flow": "38 l/min",
}


def test_answers_make_a_rig_file() -> None:
    rig = parse_rig(rig_file_text("press", "ehs", answered("ehs", ANSWERS)), source="test")
    assert (rig.name, rig.plant) == ("press", "ehs")
    assert rig.values["cylinder.rod_m"] == 0.035
    assert rig.values["cylinder.stroke_m"] == 0.3


def test_an_axis_needs_other_answers() -> None:
    entries = answered("axis", {"mass": "20 kg", "force-gain": "35 N/V", "friction": ""})
    assert {entry.key: entry.value for entry in entries}["axis.force_per_volt"] == 35.0


def test_a_drop_over_both_edges_is_halved_and_an_empty_one_is_not() -> None:
    given = ANSWERS | {"rated-drop": "70 bar"}
    values = {one.key: one.value for one in answered("ehs", given, drop_over_both=True)}
    assert values["valve.rated_pressure_drop_pa"] == 3.5e6
    answered("ehs", ANSWERS | {"rated-drop": " "}, drop_over_both=True)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"bore": ""}, r"still needed: diameter of the piston \(such as 63 mm\)"),
        ({"rod": "35 bar"}, "diameter of the rod '35 bar'"),
        ({"line-length": "2 m"}, "--line-length, --line-bore: expected both"),
        ({"rod": "70 mm"}, "thinner than the bore"),
    ],
)
def test_what_is_wrong_is_told(changed: dict[str, str], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        answered("ehs", ANSWERS | changed)
