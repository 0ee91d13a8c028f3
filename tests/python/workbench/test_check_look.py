# SPDX-License-Identifier: MIT
from pathlib import Path

import numpy as np
import pytest
from bokeh.models import GlyphRenderer

from ehsid.harness.fitness.finding import Finding, RecordCheck, Status, WrittenCheck
from ehsid.harness.show.plotting import ROLES
from ehsid.workbench.check_look import factors_plot, keep_speeds, speeds_plot
from ehsid.workbench.look import COLOURS
from ehsid.workbench.session import Session

FINDINGS = (
    Finding("direction", Status.fits, "a positive command extends the rod", None, None, None),
    Finding("supply", Status.fits, "fits", "supply.pressure_pa", 1.1, (0.8, 1.25)),
    Finding("flow", Status.does_not_fit, "twice", "valve.rated_flow_m3_s", 9.0, (None, 1.2)),
)


def checked(expected: bool) -> RecordCheck:
    time = 0.01 * np.arange(300)
    speed = 0.1 * np.sin(time)
    return RecordCheck("run", FINDINGS, (), time, speed, 2.0 * speed if expected else None)


def test_ratios_have_the_colour_of_their_outcome_and_stay_on_the_plot() -> None:
    plot = factors_plot(WrittenCheck("run", FINDINGS, ()), "light")
    assert plot is not None
    band, dots = (one for one in plot.renderers if isinstance(one, GlyphRenderer))
    assert list(band.data_source.data["left"]) == [0.8, 0.25]
    assert list(band.data_source.data["right"]) == [1.25, 1.2]
    shown = dots.data_source.data
    assert shown["check"] == ["supply", "flow"]
    assert shown["colour"] == list(COLOURS["light"][:2])
    assert shown["shown"] == ["1.1", "9"]
    assert max(shown["factor"]) <= plot.x_range.end


def test_without_a_ratio_there_is_no_plot() -> None:
    assert factors_plot(WrittenCheck("run", FINDINGS[:1], ()), "light") is None


@pytest.mark.parametrize("expected", [True, False])
def test_speeds_are_drawn_in_mm_s_over_the_whole_record(tmp_path: Path, expected: bool) -> None:
    session = Session(tmp_path)
    assert speeds_plot(session, 0, "light") is None
    keep_speeds(session, [checked(True)])
    keep_speeds(session, [checked(expected)])  # what an earlier check left does not stay
    layout = speeds_plot(session, 0, "light")
    assert layout is not None
    (plot,) = layout.children
    assert (plot.x_range.start, plot.x_range.end) == pytest.approx((0.0, 2.99))
    lines = [one for one in plot.renderers if isinstance(one, GlyphRenderer)]
    roles = [one.glyph.line_color for one in lines]
    assert roles == [ROLES["light"][role] for role in ("measured", "nominal")]
    measured, by_rig = (one.data_source.data["y"] for one in lines)
    assert np.nanmax(measured) == pytest.approx(100.0, rel=1e-3)
    assert bool(np.isfinite(by_rig).any()) is expected
