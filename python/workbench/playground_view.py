# SPDX-License-Identifier: MIT
"""The page of the playground: effects of a simulated rig, switched on and made larger.

Plots of a run beside another one, whose lines change in place.

Switches and sliders for the effects of a plant, grouped by the part of the machine.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import panel as pn

import ehsid
from ehsid.harness.catalogue.channels import CHANNELS
from ehsid.harness.catalogue.parameters import plain_name, size_name
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.show.gap_words import first_upper
from ehsid.harness.show.units import column
from ehsid.harness.signals.simulation import simulate

from . import look
from .downsampling import make_pyramid
from .lesson_part import LessonPart
from .page import View
from .playground import (
    DT_S,
    DURATION_S,
    Beside,
    beside,
    effects_of,
    excitation,
    slider_values,
    typical_sizes,
)
from .playground_rigs import chosen_rig, rig_titles
from .plots import Latest, Line, Panel, stacked
from .workbench import Workbench

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


Told = Callable[[Callable[..., None]], Callable[..., None]]


class EffectSliders:
    """The switches; sliders are made where an effect is switched on.

    Attributes
    ----------
    layout
        what the page shows.
    """

    def __init__(self, rig: Rig, changed: Callable[[], None], told: Told) -> None:
        self._rig, self._changed, self._told = rig, changed, told
        self._by_effect: dict[str, dict[str, float]] = {}
        parts: list[Any] = []
        for subsystem, effects in effects_of(rig.plant).items():
            parts.append(look.words(f"<h2>{first_upper(subsystem)}</h2>"))
            parts.append(look.in_columns(*map(self._switch, effects), least="13rem"))
        self.layout = pn.Column(*parts, sizing_mode="stretch_width")

    @property
    def sizes(self) -> dict[str, float]:
        """Sizes of the effects that are on, by full name, SI."""
        return {key: size for sizes in self._by_effect.values() for key, size in sizes.items()}

    def _switch(self, effect: ehsid.EffectInfo) -> pn.Column:
        name = first_upper(plain_name(effect.id))
        # A group of one: its words are a label of the box, those of a single Checkbox are not.
        box = pn.widgets.CheckBoxGroup(options=[name], stylesheets=[look.CONTROLS], margin=(3, 0))
        sliders = pn.Column(sizing_mode="stretch_width", margin=(0, 0, 6, 22))

        def switched(event: Any) -> None:
            if event.new:
                sizes = self._by_effect[effect.id] = typical_sizes(effect, self._rig)
                sliders.objects = [
                    self._slider(effect.id, parameter, sizes) for parameter in effect.parameters
                ]
            else:
                del self._by_effect[effect.id]
                sliders.objects = []
            self._changed()

        box.param.watch(self._told(switched), "value")
        return pn.Column(box, sliders, sizing_mode="stretch_width", margin=0)

    def _slider(
        self, effect: str, parameter: ehsid.PlantParameter, sizes: dict[str, float]
    ) -> pn.Column:
        key = ParameterKey.of_effect(effect, parameter.name)

        def moved(size: float) -> None:
            sizes[key] = size
            self._changed()

        words = size_name(key)
        sliding = slider_values(parameter)
        return look.size_slider(words, parameter.unit, sliding, sizes[key], self._told(moved))


COMMANDS = ["multisine", "steps", "triangle", "chirp"]


class PlaygroundView(View):
    """The page."""

    key = "playground"
    title = "Playground"
    purpose = (
        "See what an effect does: the same command with and without it. Below the plots, an effect "
        "can be hidden for you to find."
    )

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        titles = rig_titles(workbench)
        self._rig_title = look.select("rig", options=titles, width=290)
        self._signal = look.select("command", options=COMMANDS, width=150)
        self._share = pn.widgets.IntSlider(
            name="peak in % of the rated command", start=5, end=100, step=5, value=30, width=290,
            stylesheets=[look.CONTROLS], margin=(2, 12, 2, 0),
        )  # fmt: skip
        self._rig_title.param.watch(self.told(lambda event: self._begin()), "value")
        for field in (self._signal, self._share):
            field.param.watch(self.told(lambda event: self._excite()), "value")
        self._sliders = pn.Column(sizing_mode="stretch_width")
        self._drawn = pn.Column(sizing_mode="stretch_width")
        self._status = look.words("")
        self._document = pn.state.curdoc
        self._running = threading.Lock()
        self._wanted: dict[str, float] | None = None
        self._lesson = LessonPart(self, self._rig_title)
        chosen = pn.FlexBox(self._rig_title, self._signal, self._share)
        seen = [self._status, self._drawn, self._lesson.layout]
        self.layout.objects = [look.panes([chosen, self._sliders], seen, (2, 3))]
        self.told(self._begin)()

    def _begin(self) -> None:
        """Begins with another rig, without any effect beside its own."""
        self._rig = chosen_rig(self.workbench, str(self._rig_title.value))
        self._effects = EffectSliders(self._rig, self._compute, self.told)
        self._sliders.objects = [self._effects.layout]
        self._drawn.objects = []
        self._excite()

    def _excite(self) -> None:
        """Simulates the rig as it is; all other runs are on the same command."""
        command = excitation(self._rig, self._signal.value, self._share.value / 100.0)
        self._without: Record = simulate(self._rig, command, dt_s=DT_S).record
        if not self._drawn.objects:
            self._plots = PlaygroundPlots(self._without, self.theme)
            self._drawn.objects = [self._plots.layout]
        self._compute()

    def _compute(self) -> None:
        """Simulates in a thread; while one is at work, only the newest request is kept."""
        self._wanted = self._effects.sizes
        if self._running.acquire(blocking=False):
            threading.Thread(target=self._work, daemon=True).start()

    def _work(self) -> None:
        while (sizes := self._wanted) is not None:
            self._wanted = None
            found: Beside | Exception
            try:
                found = beside(self._rig, sizes, self._without)
            except Exception as error:  # it is told on the page
                found = error
            if self._document.session_context is not None:
                self._document.add_next_tick_callback(lambda found=found: self._show(found))
        self._running.release()

    def _show(self, found: Beside | Exception) -> None:
        if isinstance(found, Exception):
            self._status.object = look.error(self.words_of(found))
            return
        self._plots.show(found)
        on = bool(self._effects.sizes)
        self._status.object = (
            f'<p class="soft" role="status">{DURATION_S:g} s of motion, simulated in '
            f"{1e3 * found.seconds:.0f} ms.</p>"
            if on
            else '<p class="soft" role="status">Switch an effect on: its sliders appear.</p>'
        )
