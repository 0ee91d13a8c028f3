# SPDX-License-Identifier: MIT
"""The page of the playground: effects of a simulated rig, switched on and made larger."""

from __future__ import annotations

import threading

import panel as pn

from ehsid.harness.records import Record
from ehsid.harness.signals.simulation import simulate

from . import look
from .effect_sliders import EffectSliders
from .lesson_part import LessonPart
from .playground import DT_S, DURATION_S, Beside, beside, excitation
from .playground_plots import PlaygroundPlots
from .playground_rigs import chosen_rig, rig_titles
from .view import View
from .workbench import Workbench

COMMANDS = ["multisine", "steps", "triangle", "chirp"]


class PlaygroundView(View):
    """The page."""

    key = "playground"
    title = "Playground"
    purpose = (
        "See what an effect does: the same command with and without it. Further down, an effect "
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
        right = pn.Column(self._status, self._drawn, stylesheets=[look.PLAYGROUND])
        parts = look.beside(self._sliders, right, least="20rem")
        right.styles |= {"flex": "2.2 1 24rem"}
        self._document = pn.state.curdoc
        self._running = threading.Lock()
        self._wanted: dict[str, float] | None = None
        self._lesson = LessonPart(self, self._rig_title)
        self.layout.objects = [
            pn.FlexBox(self._rig_title, self._signal, self._share),
            parts,
            self._lesson.layout,
        ]
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
        """Simulates in a thread; while one is at work, only the newest wish is kept."""
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
