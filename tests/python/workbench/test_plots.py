# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from bokeh.models import CrosshairTool, GlyphRenderer

from ehsid.harness.show.plotting import DASHES, ROLES
from ehsid.workbench.downsampling import make_pyramid
from ehsid.workbench.plots import Line, Panel, stacked


def line(role: str = "") -> Line:
    return Line(role or "signal", make_pyramid(np.arange(50.0)), role=role)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_line_has_the_colour_and_the_dashes_of_its_role(theme: str) -> None:
    panel = Panel("position in mm", [line(role) for role in ROLES[theme]])
    (plot,) = stacked([panel], None, theme, "row").plots
    drawn = [one.glyph for one in plot.renderers if isinstance(one, GlyphRenderer)]
    assert [glyph.line_color for glyph in drawn] == list(ROLES[theme].values())
    dashes = {"solid": [], "dotted": [2, 4], "dashed": [6]}
    assert [glyph.line_dash for glyph in drawn] == [dashes[DASHES[role]] for role in ROLES[theme]]


def test_plots_one_below_the_other_share_time_and_cursor() -> None:
    plots = stacked([Panel(name, [line()]) for name in "abc"], None, "light", "row").plots
    assert len({plot.x_range for plot in plots}) == 1
    assert len({plot.select_one(CrosshairTool).overlay for plot in plots}) == 1
