# SPDX-License-Identifier: MIT
"""What the page says of a missing law."""

from __future__ import annotations

import numpy as np
import pytest
from bokeh.models import Legend
from made_diagnoses import missing_law
from msgspec.structs import replace

from ehsid.harness.diagnosis.result import Wandering
from ehsid.harness.show.page import Card, Note, Plot
from ehsid.harness.show.which_section import missing_law_section, wandering_section


def card(rivals: tuple[tuple[str, str], ...]) -> Card:
    section = missing_law_section((replace(missing_law(), rivals=rivals),), (None,))
    (found,) = (block for block in section.blocks if isinstance(block, Card))
    return found


def notes(rivals: tuple[tuple[str, str], ...]) -> list[str]:
    return [block.text for block in card(rivals).blocks if isinstance(block, Note)]


def test_a_law_has_a_curve_and_its_form_in_words() -> None:
    blocks = card(()).blocks
    assert sum(isinstance(block, Plot) for block in blocks) == 1
    (note,) = notes(())
    assert note.startswith("It jumps by 824 N at zero and is level on both sides, as Coulomb")
    assert "100\N{NO-BREAK SPACE}% of the shrinkage" in note


@pytest.mark.parametrize(
    ("rival", "words"),
    [
        (("force", "time_s"), "a second time"),
        (("force", "position_m"), "another place of the stroke"),
        (("spool", "spool"), "half the speed"),
        (("flow_a", "velocity_m_s"), "Record the pressures, too"),
    ],
)
def test_rivals_come_with_the_motion_that_separates_them(
    rival: tuple[str, str], words: str
) -> None:
    _, note = notes((rival,))
    assert "These records hardly tell it from" in note
    assert words in note


def test_without_a_law_there_is_no_section() -> None:
    assert missing_law_section((), ()).blocks == []


@pytest.mark.parametrize(("equation", "steady", "unit"), [("sensor", 1, "mm"), ("spool", 0, "%")])
def test_what_wanders_has_a_curve_of_each_record(equation: str, steady: int, unit: str) -> None:
    time_s = np.linspace(0.25, 9.75, 20)
    curves = {name: (time_s, 1e-3 * np.sin(rate * time_s)) for rate, name in enumerate("ab", 1)}
    text, plot = wandering_section(Wandering(equation, 0.1, curves)).blocks
    assert isinstance(text, str)
    assert text.count("A steady rate") == steady
    assert isinstance(plot, Plot)
    (legend,) = plot.figure.select(type=Legend)
    assert [item.label.value for item in legend.items] == ["a", "b"]
    assert plot.figure.yaxis.axis_label.endswith(f" in {unit}")
    drawn = [item.renderers[0].data_source.data for item in legend.items]
    scale = 1e3 if unit == "mm" else 100.0
    for (time_s, value), data in zip(curves.values(), drawn, strict=True):
        assert np.allclose(data["x"], time_s)
        assert np.allclose(data["y"], scale * value)


def test_where_nothing_wanders_there_is_no_section() -> None:
    assert wandering_section(None).blocks == []
