# SPDX-License-Identifier: MIT
"""Orders: the order and the delay of a linear model, why they were chosen, and how well it fits.

The part of the step Next that makes the header for the firmware.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import panel as pn

from ehsid.harness.base.encoding import from_json
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.models.identification.selection import MOST_DELAY, MOST_ORDER, parse_range
from ehsid.harness.show.gap_words import first_upper
from ehsid.harness.show.model_file_names import IDENTIFICATION_FILES
from ehsid.harness.show.page import Block, Heading, Items, whole
from ehsid.harness.show.units import column, over, si_column

from .. import look
from ..flow import IDENTIFIED, step_states
from ..model_look import look_folder, read_looks
from ..model_plots import DrawnModel, bode_plots, correlation_plot, poles_plot, simulation_plots
from ..next_tasks import FIRMWARE, MADE, HeaderMade
from ..reading import reading_of
from .models_found import ModelsFound
from .step import StepView, progress

FILE_WORDS = dict(
    zip(IDENTIFICATION_FILES, ("all numbers", "fit and residual tests", "Bode plot"), strict=True)
)


class Identification(StepView):
    """The first part of the step Model."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._choice = self.session.settings.model
        self._record = self._select("record", "record")
        self._input = self._select("input", "input_name")
        self._output = self._select("output", "output_name")
        self._orders = self._range("orders to try", "orders", MOST_ORDER)
        self._delays = self._range("delays to try, in samples", "delays", MOST_DELAY)
        self._start = self.button("Identify", primary=True)
        self._start.on_click(page.told(lambda event: self.workbench.identify(self.session)))
        self._cancel, self._status = self.follow("identify")
        self._verdict = look.words("")
        self._models = ModelsFound(page)
        self._drawn = look.Sheets({})
        self._shown: object = None
        self._quiet = False
        chosen = look.beside(
            self._record, self._input, self._output, self._orders, self._delays, least="11rem"
        )
        started = pn.Row(self._start, self._cancel)
        told = [chosen, started, self._status, self._verdict, self._models.layout]
        self.layout.objects = [look.panes(told, [self._drawn.layout], (1, 2))]

    def _select(self, words: str, name: str) -> pn.widgets.Select:
        made = look.select(words)
        made.param.watch(self.page.told(lambda event: self._choose(name, event.new)), "value")
        return made

    def _range(self, words: str, name: str, most: int) -> pn.widgets.TextInput:
        value = getattr(self._choice, name)
        made = look.text_input(words, value=value, placeholder="such as 2-5")

        def changed(event: Any) -> None:
            parse_range(event.new, words, most)
            self._choose(name, event.new)

        made.param.watch(self.page.told(changed), "value")
        return made

    def _choose(self, name: str, value: str | None) -> None:
        choice = self._choice
        if self._quiet or value is None or getattr(choice, name) == value:
            return
        before = getattr(choice, name)
        setattr(choice, name, value)
        if choice.input_name == choice.output_name:  # the two change places
            setattr(choice, "output_name" if name == "input_name" else "input_name", before)
        self.session.save()

    def refresh(self) -> None:
        """Shows the choices, how the identification goes, and what it found."""
        self._show_choices()
        job = self.workbench.job(self.session, "identify")
        running = job is not None and job.running
        self._start.disabled = running
        self._cancel.visible = running
        self._status.object = progress(job)
        path = self.session.folder / IDENTIFIED
        stale = "" if running else step_states(self.session)["model"].why
        version = path.stat().st_mtime_ns if path.exists() else 0
        shown = (version, stale, tuple(self._choice.beside))
        if shown == self._shown or (running and self._shown is not None):
            return
        self._shown = shown
        models = read_looks(self.session) if version else []
        self._models.show(models)
        if not models:
            self._verdict.object = (
                '<p class="soft">A linear model is fitted to one half of the record and judged on '
                "the other half. This takes seconds. The step may be left out.</p>"
            )
            self._drawn.show({})
            return
        found = models[0]
        warned = f'<p class="bad">{look.plain(stale[0].upper() + stale[1:])}</p>' if stale else ""
        name = f"model {found.number}, " if len(models) > 1 else ""
        words = look.plain(whole(f"{first_upper(name)}{found.record}: {found.line}."))
        verdict = f'<p class="verdict">{words}</p>'
        self._verdict.object = warned + verdict
        self._drawn.show(self._parts(self._models.drawn(models), version))

    def _show_choices(self) -> None:
        entry = self.session.modelled()
        reading = None if entry is None else reading_of(self.session, entry)
        names = [one.id for one in self.session.settings.records]
        columns = [] if reading is None else [one for one in reading.channels if one != TIME]
        options = {column(one).words: one for one in columns}
        self._quiet = True
        try:
            self._record.param.update(options=names, value=entry.id if entry else None)
            self._record.visible = len(names) > 1
            for widget, value in (
                (self._input, self._choice.input_name),
                (self._output, self._choice.output_name),
            ):
                known = options if value in columns else {**options, value: value}
                widget.param.update(options=known, value=value)
        finally:
            self._quiet = False

    def _parts(
        self, models: Sequence[DrawnModel], version: int
    ) -> dict[str, list[pn.viewable.Viewable]]:
        """Returns the plots and tables of the newest model, with others beside it."""
        theme, found = self.page.theme, models[0].model
        told, of = found.told, f" of {models[0].name}" if len(models) > 1 else ""
        tests = (
            correlation_plot(found.whiteness, "autocorrelation", theme),
            correlation_plot(found.independence, "correlation with input", theme),
        )
        unit = over(si_column(found.output_name), si_column(found.input_name))
        bode = bode_plots(models, unit, theme)
        model: list[Block] = [Heading(f"The servo{of}"), *told.servo]
        model += [Heading(f"Coefficients{of}"), told.coefficients]
        roots: list[Block] = [Heading(f"Poles and zeros{of}"), told.roots]
        orders = (Heading("Orders tried"), told.orders)
        reasons: list[Block] = [Heading("Why this one"), Items(told.reasons)]
        if told.advice:
            reasons += [Heading("Be careful"), Items(told.advice)]
        return {
            "Simulation": [
                look.drawn(simulation_plots(models, look_folder(self.session), theme)),
            ],
            "Frequencies": [
                look.words(
                    "<p>Frequency response, with its 95 % band. Grey: frequencies at which the "
                    "input has next to no power; what the model says there is extrapolated.</p>"
                ),
                *map(look.drawn, bode),
            ],
            "Servo": [look.words(look.told(*model))],
            "Poles": [
                look.side_by_side(
                    look.words(look.told(*roots)),
                    pn.pane.Bokeh(poles_plot(models, theme), margin=0),
                )
            ],
            "Residual": [
                look.words(look.told(Heading(f"The residual{of}"), Items(told.tests))),
                look.side_by_side(*map(look.drawn, tests)),
            ],
            "Reasons": [look.words(look.told(*reasons))],
            "Orders": [look.words(look.told(*orders) + self._links(version))],
        }

    def _links(self, version: int) -> str:
        address = f"/result/{self.session.name}/model"
        return f"<h2>Files</h2>{look.files(address, FILE_WORDS, f'?made={version}')}"


WHY = (
    "<h2>Header for the firmware</h2><p>It starts the recursive estimator of the firmware from a "
    "model of one record. Without a tick, offline identification chooses the orders na, nb and "
    "nk, and the forgetting policy f-ratio keeps what the start knows. The C++ header brings a "
    "self-test that the target can run.</p>"
)
LANGUAGES = {"C++17": False, "C99": True}


class HeaderPart:
    """Fields, button, progress and preview."""

    def __init__(self, step: StepView) -> None:
        self._page, self._session, self._workbench = step.page, step.session, step.workbench
        firmware = self._session.settings.firmware
        ids = [entry.id for entry in self._session.settings.records]
        if firmware.record not in ids:
            firmware.record = ids[0] if ids else ""
        self._record = look.select(
            "record of the model", options=ids, value=firmware.record or None
        )
        self._language = look.select("language", options=LANGUAGES, value=firmware.c)
        self._name = look.text_input("namespace in C++, prefix in C", value=firmware.name)
        choice = self._session.settings.model
        self._like_model = look.tick(
            f"orders and forgetting of the step Model: na {choice.na}, nb {choice.nb}, "
            f"nk {choice.nk}, {choice.policy}",
            firmware.like_model,
        )
        for field in (self._record, self._language, self._name, self._like_model):
            field.param.watch(self._page.told(self._choose), "value")
        self._make = step.button("Make the header")
        self._make.on_click(self._page.told(self._start))
        self._status, self._result = look.words(""), look.words("")
        fields = look.beside(self._record, self._language, self._name, least="11rem")
        asked = [look.words(WHY), fields, self._like_model, pn.Row(self._make), self._status]
        self.layout = look.panes(asked, [self._result])

    def _choose(self, _event: Any) -> None:
        firmware = self._session.settings.firmware
        firmware.record, firmware.c = self._record.value or "", self._language.value
        firmware.name, firmware.like_model = self._name.value.strip(), bool(self._like_model.value)
        self._session.save()

    def _start(self, event: Any) -> None:
        from ehsid.harness.firmware import check_name

        self._choose(event)
        check_name(self._session.settings.firmware.name)
        self._workbench.make_header(self._session)

    def refresh(self) -> None:
        """Shows how the work goes, and the header."""
        job = self._workbench.job(self._session, "header")
        self._make.disabled = job is not None and job.running
        self._status.object = progress(job)
        html = self._preview()
        if self._result.object != html:
            self._result.object = html

    def _preview(self) -> str:
        folder = self._session.folder / FIRMWARE
        try:
            made = from_json((folder / MADE).read_bytes(), HeaderMade)
            text = (folder / made.file).read_text(encoding="utf-8")
        except (OSError, msgspec.DecodeError):
            return ""
        entry = self._session.entry(made.record)
        stale = ""
        if entry is None or entry.told() != made.told:
            stale = '<p class="bad">The record has changed since; make the header again.</p>'
        address = f"/result/{self._session.name}/{FIRMWARE}/{made.file}?download=1"
        return (
            f'{stale}<p><a href="{address}">Download {made.file}</a>, made of '
            f"{look.plain(made.record)}: {look.plain(made.summary)}</p>"
            f'<pre class="preview" tabindex="0" aria-label="Preview of the header">'
            f"{look.plain(text)}</pre>"
        )
