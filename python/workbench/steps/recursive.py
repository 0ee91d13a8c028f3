# SPDX-License-Identifier: MIT
"""Recursive: the estimator of the firmware over a record; it follows the sliders.

Model: a linear model of a record, and the estimator of the firmware on it.
"""

from __future__ import annotations

import time
from typing import Any

import panel as pn

from ehsid.harness.catalogue.parameters import METHODS, POLICIES, policies_of
from ehsid.harness.models.identification import IoData
from ehsid.harness.records import Record
from ehsid.harness.show.model_file_names import ESTIMATION_FILES
from ehsid.harness.show.page import Block, Items, Note

from .. import look
from ..model_look import (
    EstimateLook,
    look_of,
    read_estimate_look,
)
from ..model_plots import EstimatePlots
from ..model_tasks import estimated, io_data, set_method, set_policy, slider_values, value_of
from ..reading import reading_of
from ..session import MOST_COEFFICIENTS, MOST_DELAY
from .identification import Identification
from .step import StepView, progress

# To try the changes takes several times as long as the estimate, too long for a slider that moves.
WRITE_TO_LEARN = "What would help on this record is tried when its files are written."
# Up to here an estimate takes at most 0.2 s; longer records go to a process of their own.
LIVE_SAMPLES = 100_000
REMARKS, AT_THE_END = "Remarks", "At the end"  # sheets beside those of the plots


class Recursive(StepView):
    """The second part of the step Model."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._choice = self.session.settings.model
        self._read: tuple[object, IoData, Record] | None = None
        self._plots: EstimatePlots | None = None
        self._moved: dict[str, pn.widgets.DiscreteSlider] = {}
        self._shown = self._asked = ""
        self._quiet = False
        self._orders = {
            name: self._select(name, list(range(least, most + 1)), name)
            for name, least, most in (
                ("na", 1, MOST_COEFFICIENTS),
                ("nb", 1, MOST_COEFFICIENTS),
                ("nk", 0, MOST_DELAY),
            )
        }
        methods = {f"{key}: {method.words}": key for key, method in METHODS.items()}
        self._method = self._select("recursion", methods, "method")
        self._policy = self._select("forgetting policy", list(POLICIES), "policy")
        self._about = look.words("")
        resets = {"where the RMSE shows a change": True, "never": False}
        self._reset = self._select("reset", resets, "reset")
        self._sliders = pn.FlexBox(sizing_mode="stretch_width", gap="0 1.2rem")
        self._write = self.button("Write estimate.json and its figure")
        self._write.on_click(page.told(lambda event: self.workbench.estimate(self.session)))
        self._status, self._outcome, self._remarks, self._end_table, self._links = (
            look.words("") for _ in range(5)
        )
        self._end = pn.Column(
            self._end_table, self._write, self._links, sizing_mode="stretch_width"
        )
        self._drawn = pn.Column(sizing_mode="stretch_width")
        choices = [
            look.beside(*self._orders.values(), least="6rem"),
            look.beside(self._method, self._policy, self._reset, least="12rem"),
            self._about,
            self._sliders,
            self._status,
            self._outcome,
        ]
        self._switch = look.Switch(self._turn)
        drawn = [self._switch.layout, self._drawn, self._remarks, self._end]
        self.layout.objects = [look.panes(choices, drawn, (1, 1))]

    def _select(self, words: str, options: Any, name: str) -> pn.widgets.Select:
        made = look.select(words, options=options, value=getattr(self._choice, name))
        made.param.watch(self.page.told(lambda event: self._choose(name, event.new)), "value")
        return made

    def _choose(self, name: str, value: Any) -> None:
        if self._quiet or getattr(self._choice, name) == value:
            return
        if name == "method":
            set_method(self._choice, value)
        elif name == "policy":
            set_policy(self._choice, value)
        else:
            setattr(self._choice, name, value)
        self.session.save()

    def _slide(self, name: str, value: float) -> None:
        """Follows a slider on its way; the choice is kept when it is released."""
        if not self._quiet:
            self._choice.settings[name] = value
            if self._is_live():
                self._estimate()

    def _is_live(self) -> bool:
        entry = self.session.modelled()
        reading = None if entry is None else reading_of(self.session, entry)
        return reading is not None and reading.samples <= LIVE_SAMPLES

    def refresh(self) -> None:
        """Shows the choices and the estimate that belongs to them."""
        self._show_choices()
        job = self.workbench.job(self.session, "estimate")
        self._status.object = progress(job)
        live = self._is_live()
        self._write.visible = live
        self._write.disabled = job is not None and job.running
        if live:
            self._estimate()
        else:
            self._estimate_apart()
        self._show_links()

    def _show_choices(self) -> None:
        choice = self._choice
        self._quiet = True
        try:
            for name, widget in self._orders.items():
                widget.value = getattr(choice, name)
            self._method.value = choice.method
            self._policy.param.update(options=list(policies_of(choice.method)), value=choice.policy)
            self._reset.value = choice.reset
        finally:
            self._quiet = False
        info = POLICIES[choice.policy]
        self._about.object = (
            f'<p class="soft small">{choice.method} is right with {METHODS[choice.method].noise}. '
            f"{choice.policy}: {look.plain(info.summary)} ({look.plain(info.source)}).</p>"
        )
        values = {setting.name: value_of(choice, setting) for setting in info.settings}
        # A slider that is moved stays as it is, so that it keeps the focus of the keyboard.
        if {name: slider.value for name, slider in self._moved.items()} != values:
            self._moved = {one.name: self._slider(one) for one in info.settings}
            self._sliders.objects = [
                _explained(self._moved[setting.name], setting.meaning) for setting in info.settings
            ]

    def _slider(self, setting: Any) -> pn.widgets.DiscreteSlider:
        value = value_of(self._choice, setting)
        unit = "" if setting.unit == "1" else f" in {setting.unit}"
        slider = pn.widgets.DiscreteSlider(
            name=f"{setting.member}{unit}",
            options=slider_values(setting, value),
            value=value,
            formatter="%.6g",
            stylesheets=[look.CONTROLS],
            sizing_mode="stretch_width",
            margin=(4, 0, 0, 0),
        )
        slider.param.watch(
            self.page.told(lambda event: self._slide(setting.name, event.new)), "value"
        )
        slider.param.watch(self.page.told(lambda event: self.session.save()), "value_throttled")
        return slider

    def _estimate(self) -> None:
        """Runs the estimator in this process, and shows what it gives."""
        key = self.session.made_from("estimate")
        if key == self._shown:
            return
        self._shown = key
        began = time.perf_counter()
        try:
            data, record = self._data()
            found = look_of(self.session, record, estimated(self.session, data), data)
        except ValueError as error:
            self._fail(str(error))
            return
        self._show(found, time.perf_counter() - began)

    def _data(self) -> tuple[IoData, Record]:
        entry, choice = self.session.modelled(), self._choice
        key = (entry and (entry.id, entry.told()), choice.input_name, choice.output_name)
        if self._read is None or self._read[0] != key:
            self._read = (key, *io_data(self.session))
        return self._read[1:]

    def _estimate_apart(self) -> None:
        """Shows what the process of its own gave; it is started once for each choice."""
        key = self.session.made_from("estimate")
        if key == self._shown:
            return
        found = read_estimate_look(self.session)
        if found is not None and found.figures.made_from == key:
            self._shown = key
            self._show(found, None)
        elif self._asked != key:
            self._asked = key
            self.workbench.estimate(self.session)

    def _show(self, found: EstimateLook, seconds: float | None) -> None:
        count = found.figures.n_samples
        took = "" if seconds is None else f": {count} samples in {1e3 * seconds:.0f} ms"
        told = found.figures.told
        blocks: list[Block] = [*told.servo[:1], *told.figures[:1]]
        if not found.figures.converged and seconds is not None:
            blocks.append(WRITE_TO_LEARN)
        computed = Note(f"Computed with the code of the firmware{took}.")
        self._outcome.object = look.told(*blocks, computed)
        self._remarks.object = look.told(told.head, *told.servo[1:], *told.figures[1:])
        self._end_table.object = look.told(told.parameters)
        if self._plots is not None and self._plots.fits(found):
            self._plots.show(found)
            return
        self._plots = EstimatePlots(found, self.page.theme)
        self._plots.choose(self._switch.chosen or next(iter(self._plots.groups)))
        self._drawn.objects = [self._plots.layout]
        self._switch.offer([*self._plots.groups, REMARKS, AT_THE_END])

    def _turn(self) -> None:
        """Shows the sheet that was chosen."""
        chosen = self._switch.chosen
        self._remarks.visible, self._end.visible = chosen == REMARKS, chosen == AT_THE_END
        self._drawn.visible = self._plots is not None and chosen in self._plots.groups
        if self._plots is not None:
            self._plots.choose(chosen)

    def _fail(self, text: str) -> None:
        self._outcome.object = look.error(text)
        self._plots = None
        self._drawn.objects = []
        self._switch.offer([])

    def _show_links(self) -> None:
        if not (self.session.folder / "model" / ESTIMATION_FILES[0]).exists():
            self._links.object = ""
            return
        made = self.session.settings.made_of.get("estimate")
        stale = "" if made == self.session.made_from("estimate") else " of earlier choices"
        address = f"/result/{self.session.name}/model"
        links = " and ".join(
            f'<a href="{address}/{name}?made={made}" target="_blank">{name}</a>'
            for name in ESTIMATION_FILES
        )
        kept = None if stale else read_estimate_look(self.session)
        tries: list[Block] = []
        if kept is not None and kept.figures.tries:
            tries = ["What to try:", Items(kept.figures.tries)]
        self._links.object = f"<p>Written: {links}{stale}.</p>{look.told(*tries)}"


def _explained(slider: pn.widgets.DiscreteSlider, meaning: str) -> pn.Column:
    held = pn.Column(slider, look.words(f'<p class="soft small">{look.plain(meaning)}</p>'))
    held.styles = {"flex": "1 1 14rem", "min-width": "min(14rem, 100%)"}
    return held


class ModelStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._parts = (Identification(page), Recursive(page))
        names = ("Linear model", "Recursive")
        parts = {name: [part.layout] for name, part in zip(names, self._parts, strict=True)}
        self.layout.objects = [look.Sheets(parts).layout]

    def refresh(self) -> None:
        """Shows what has changed in both parts."""
        for part in self._parts:
            part.refresh()
