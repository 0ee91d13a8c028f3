# SPDX-License-Identifier: MIT
"""What the step Check draws of a record: what it shows over what the rig says, and its speed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from bokeh.models import Column, FixedTicker, HoverTool, Range1d
from bokeh.models import Span as Mark
from bokeh.plotting import figure

from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.fitness.finding import RecordCheck, Status, WrittenCheck
from ehsid.harness.show.rig_check import TICKS, WIDEST

from .downsampling import make_pyramid, opened, store
from .look import COLOURS, THEMES, dress
from .plots import Line, Panel, stacked
from .session import Session

MEASURED, EXPECTED = "measured", "by the rig's values"
ROLES = {MEASURED: "measured", EXPECTED: "nominal"}
ROW = 24  # in pixels: the height of a finding


def _folder(session: Session) -> Path:
    """Returns the folder of what is drawn; no record can have its name."""
    return session.folder / "looks" / "_check"


def keep_speeds(session: Session, checks: Sequence[RecordCheck]) -> None:
    """Writes the speeds of all records, as the page draws them."""
    folder = _folder(session)
    folder.mkdir(parents=True, exist_ok=True)
    for number, check in enumerate(checks):
        np.save(folder / f"{number}_{TIME}.npy", check.time_s)
        for name, speed in ((MEASURED, check.speed_m_s), (EXPECTED, check.expected_m_s)):
            if speed is None:  # a speed of an earlier rig must not stay
                speed = np.full_like(check.time_s, np.nan)
            store(make_pyramid(speed), folder, f"{number}_{name}")


def speeds_plot(session: Session, number: int, theme: str) -> Column | None:
    """Returns measured and expected speed over the whole record; None where they are not kept."""
    folder = _folder(session)
    path = folder / f"{number}_{TIME}.npy"
    if not path.exists():
        return None
    lines = [
        Line(name, opened(folder, f"{number}_{name}"), 1e3, role=role)
        for name, role in ROLES.items()
    ]
    time_s = np.load(path, mmap_mode="r")
    return stacked([Panel("speed in mm/s", lines)], time_s, theme, "time in s").layout


def factors_plot(check: WrittenCheck, theme: str) -> figure | None:
    """Returns a row for each finding that is a ratio: the ratio, and the ratios that would fit."""
    rows = [one for one in check.findings if one.factor is not None]
    if not rows:
        return None
    ink, colours = THEMES[theme], COLOURS[theme]
    of = {Status.fits: colours[0], Status.does_not_fit: colours[1]}
    plot = figure(
        height=ROW * len(rows) + 75,
        sizing_mode="stretch_width",
        x_axis_type="log",
        x_range=Range1d(0.9 / WIDEST, 1.3 * WIDEST),
        y_range=[one.check for one in reversed(rows)],
        tools="",
        toolbar_location=None,
        x_axis_label="shown by the record / in the rig; band: fits",
        min_border_left=70,
    )
    ends = [one.fitting or (None, None) for one in rows]
    known = [(low, high) if high is not None else None for low, high in ends]
    drawn = plot.hbar(
        y=[one.check for one, pair in zip(rows, known, strict=True) if pair],
        left=[max(pair[0] or 0.0, 1.0 / WIDEST) for pair in known if pair],
        right=[min(pair[1], WIDEST) for pair in known if pair],
        height=0.6,
        fill_color=ink["line"],
        line_color=None,
    )
    drawn.level = "underlay"
    plot.add_layout(Mark(location=1.0, dimension="height", line_color=ink["soft"]))
    dots = plot.scatter(
        "factor",
        "check",
        size=9,
        color="colour",
        source={
            "check": [one.check for one in rows],
            "factor": [min(max(one.factor or 1.0, 1.0 / WIDEST), WIDEST) for one in rows],
            "shown": [f"{one.factor:.3g}" for one in rows],
            "why": [one.text for one in rows],
            "colour": [of.get(one.status, ink["soft"]) for one in rows],
        },
    )
    tips = [("ratio", "@shown"), ("why", "@why")]
    plot.add_tools(HoverTool(renderers=[dots], tooltips=tips))
    plot.xaxis.ticker = FixedTicker(ticks=list(TICKS))
    told = {tick: f"{tick:g}" for tick in (0.25, 0.5, 1.0, 2.0, 4.0)}  # others have no room
    plot.xaxis.major_label_overrides = dict.fromkeys(TICKS, "") | told
    dress(plot, theme)
    plot.ygrid.visible = False
    return plot
