# SPDX-License-Identifier: MIT
"""The drawing of the machine has the proportions and the values of the form."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from ehsid.workbench.steps.rig import machine_svg


def boxes(svg: str) -> list[dict[str, str]]:
    return [node.attrib for node in ET.fromstring(svg).iter("rect")]


def test_values_are_written_and_unknown_ones_are_question_marks() -> None:
    svg = machine_svg({"bore": "63 mm", "mass": "<b>&"}, {}, double=False)
    words = [node.text for node in ET.fromstring(svg).iter("text")]
    assert "⌀ 63 mm" in words
    assert "⌀ ?" in words
    assert "<b>&" in words


def test_a_thicker_rod_is_drawn_thicker_and_a_long_stroke_longer() -> None:
    def rod_and_length(rod: float, stroke: float) -> tuple[float, float]:
        svg = machine_svg({}, {"bore": 0.1, "rod": rod, "stroke": stroke}, double=False)
        drawn = boxes(svg)
        return float(drawn[2]["height"]), float(drawn[0]["width"])

    thin, thick = rod_and_length(0.02, 0.2), rod_and_length(0.08, 0.35)
    assert thick[0] > 3.0 * thin[0]
    assert thick[1] > thin[1]
    assert rod_and_length(9.0, 99.0)[1] < 300.0  # what cannot be stays on the drawing


def test_a_rod_on_both_sides_is_drawn_twice() -> None:
    one, two = (boxes(machine_svg({}, {}, double=double)) for double in (False, True))
    assert len(two) == len(one) + 1
