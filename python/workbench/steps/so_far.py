# SPDX-License-Identifier: MIT
"""What a diagnosis at work knows so far: its stages, the gap, the sets ahead, and the signals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import panel as pn
from bokeh.models import Column

from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.diagnosis import STAGES, in_words
from ehsid.harness.show.gap_words import first_upper
from ehsid.harness.show.page import Bar, Table
from ehsid.harness.show.shares import percent

from .. import look
from ..downsampling import opened
from ..plots import Line, Panel, stacked
from ..so_far import ERROR, TIME, SoFar, key, latest

KINDS = {"calibrated": "values fitted", "augmented": "set that is ahead"}
SOMETIMES = ("together", "laws", "where", "experiment")  # stages that need not take place
BARS = {
    "nominal": "as configured",
    "calibrated": "values fitted",
    "augmented": "set that is ahead",
    "floor": "noise floor",
}


class SoFarView:
    """A part of the step Gap; it is empty while nothing is known."""

    def __init__(self, session: Path, theme: str) -> None:
        self._session, self._theme = session, theme
        self._known = look.words("")
        self._plots = pn.Column(sizing_mode="stretch_width")
        self._folder: Path | None = None
        self._drawn: Column | None = None
        self.layout = pn.Column(self._known, self._plots, sizing_mode="stretch_width")

    def refresh(self, *, running: bool) -> None:
        """Shows the last stage that is known."""
        found = latest(self._session) if running else None
        if found is None:
            self._folder, self._known.object, self._plots.objects = None, "", []
            self._drawn = None
            return
        folder, known = found
        if folder == self._folder:
            return
        self._folder = folder
        self._known.object = _words(known)
        if known.stage == "values" or not known.runs:
            return
        plots = _plots(folder, known, self._theme)
        if self._drawn is not None:  # the range that is looked at stays
            seen = self._drawn.children[0].x_range
            plots.children[0].x_range.update(start=seen.start, end=seen.end)
        self._drawn = plots
        self._plots.objects = [plots]


def _plots(folder: Path, known: SoFar, theme: str) -> Column:
    """Returns the plots of the first record: each output, and what the simulations miss of it."""
    time_s = np.load(folder / f"0_{TIME}.npy")
    kinds = {kind: words for kind, words in KINDS.items() if kind == "calibrated" or known.ahead}
    panels = []
    for place, name in enumerate(known.runs[0].outputs):
        words, factor, unit = shown_channel(name)

        def line(kind: str, words: str, place: int = place, factor: float = factor) -> Line:
            return Line(words, opened(folder, key(0, place, kind)), factor)

        simulated = [line(kind, of) for kind, of in kinds.items()]
        errors = [line(kind + ERROR, of) for kind, of in kinds.items()]
        panels.append(Panel(f"{words} in {unit}", [*simulated, line("measured", "measured")]))
        panels.append(Panel(f"error in {unit}", errors))
    return stacked(panels, time_s, theme, "time in s").layout


def _words(known: SoFar) -> str:
    """Returns stages, gaps and sets as HTML."""
    past = dict.fromkeys(known.past)
    stages = "".join(
        f"<li>{'▸ <b>' if stage == known.stage else '✓ ' if stage in past else ''}{words}"
        f"{'</b>' if stage == known.stage else ''}</li>"
        for stage, words in STAGES.items()
        if stage == known.stage or stage in past or stage not in SOMETIMES
    )
    html = f'<div class="columns"><ul class="stages">{stages}</ul>'
    if known.stage == "values":
        return html + "</div>"
    gaps = {kind: getattr(known, kind) for kind in BARS}
    if known.stage == "alone":
        del gaps["augmented"]
    bars = look.told(_bars(gaps))
    html += f"<div><b>Gap on held-out data, so far</b>{bars}</div></div>"
    if known.sets:
        rows = [(first_upper(in_words(ids)), _percent(gap)) for ids, gap in known.sets]
        headings = ("sets that were tried, so far", "gap that is left")
        html += look.told(Table("", headings, rows))
    html += '<p class="soft">Not a result yet: what has more values always leaves less.</p>'
    if known.runs:
        name = look.plain(known.runs[0].record)
        html += f"<p>Held-out data of {name}; error: simulated minus measured.</p>"
    return html


def _bars(gaps: dict[str, float | None]) -> Table:
    largest = max((gap for gap in gaps.values() if gap is not None), default=0.0) or 1.0
    rows = [
        (BARS[kind], Bar("", _percent(gap), 100.0 * (gap or 0.0) / largest))
        for kind, gap in gaps.items()
    ]
    return Table("", ("simulation", "gap"), rows)


def _percent(gap: float | None) -> str:
    return "diverges" if gap is None else percent(gap)
