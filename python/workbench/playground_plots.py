# SPDX-License-Identifier: MIT
"""Plots of a run beside another one, whose lines change in place."""

from __future__ import annotations

from ehsid.harness.catalogue.channels import CHANNELS
from ehsid.harness.records import Record
from ehsid.harness.show.units import column

from .downsampling import make_pyramid
from .playground import Beside
from .plots import Latest, Line, Panel, stacked

# Signals that are drawn, as far as the plant has them.
SIGNALS = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")
WITHOUT, HAVING, DIFFERENCE = "without", "with effects", "difference"
WIDE = 3.0  # of the line without effects, below the other: both are seen where they agree


class PlaygroundPlots:
    """Plots one below the other: each signal of two runs, and the difference of their positions."""

    def __init__(self, without: Record, theme: str) -> None:
        names = [name for name in SIGNALS if name in without.columns]
        self._signals = {
            (name, kind): Latest(make_pyramid(without.column(name)))
            for name in names
            for kind in (WITHOUT, HAVING, DIFFERENCE)
        }
        panels = [
            Panel(column(name).label, [self._line(name, kind) for kind in (WITHOUT, HAVING)])
            for name in names
        ]
        unit = CHANNELS[names[0]].shown_unit
        panels.append(Panel(f"difference in {unit}", [self._line(names[0], DIFFERENCE)]))
        self._stack = stacked(panels, without.time_s, theme, "time in s")
        for plot in self._stack.plots[:-1]:
            plot.renderers[0].glyph.line_width = WIDE
        self.layout = self._stack.layout

    def _line(self, name: str, kind: str) -> Line:
        return Line(kind, self._signals[name, kind], CHANNELS[name].factor)

    def show(self, runs: Beside) -> None:
        """Shows two runs."""
        for (name, kind), signal in self._signals.items():
            values = (runs.without if kind == WITHOUT else runs.having).column(name)
            if kind == DIFFERENCE:
                values = values - runs.without.column(name)
            signal.now = make_pyramid(values)
        self._stack.draw()
