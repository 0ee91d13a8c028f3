# SPDX-License-Identifier: MIT
"""Rig: what is known of the machine, in the units of engineers; typical values fill the rest."""

from __future__ import annotations

from typing import Any

import panel as pn

from ehsid.harness.base.files import result_files, write_text
from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.harness.rigs import RigError, read_rig
from ehsid.harness.rigs.answers import answered, read_answer, rig_file_text
from ehsid.harness.rigs.new import Entry, shown
from ehsid.harness.rigs.questions import EXAMPLES, QUESTIONS, Question
from ehsid.harness.show.page import Table, Tagged

from .. import look
from ..drawing import machine_svg
from ..session import RIG
from .step import StepView

PLANTS = {"hydraulic: valve and cylinder": "ehs", "motor-driven axis": "axis"}


class RigStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._known = self.session.settings.rig
        self._fields: dict[str, pn.widgets.TextInput] = {}
        self._problems: dict[str, pn.pane.HTML] = {}
        self._plant = pn.widgets.RadioButtonGroup(
            name="machine", options=PLANTS, value=self._known.plant, stylesheets=[look.CONTROLS]
        )
        self._plant.param.watch(page.told(self._change_plant), "value")
        self._form = pn.Column()
        self._drawing, self._values = look.words(""), look.words("")
        self._shown: object = None
        self._build()

    @property
    def _given_as_file(self) -> bool:
        return self.session.rig_file.exists() and not any(self._known.answers.values())

    def _build(self) -> None:
        if self._given_as_file:
            anew = self.button("Describe the machine anew")
            anew.on_click(self.page.told(self._anew))
            self.layout.objects = [self._values, anew]
            return
        self._fields, self._problems = {}, {}
        questions = QUESTIONS[self._known.plant]
        needed = [self._field(one) for one in questions if one.essential]
        further = [self._field(one) for one in questions if not one.essential]
        self._form.objects = [
            self._plant,
            look.words("<h2>Needed</h2>"),
            look.beside(*needed, least="13rem"),
            look.words('<h2>If known</h2><p class="soft small">Empty: a typical value.</p>'),
            *self._flags(),
            look.beside(*further, least="13rem"),
        ]
        beside = look.beside(self._form, self._drawing, least="24rem")
        self._drawing.styles |= {"position": "sticky", "top": "1rem"}
        self.layout.objects = [beside, self._values]
        self._redraw()

    def _field(self, question: Question) -> pn.Column:
        field = look.text_input(
            question.words,
            value=self._known.answers.get(question.name, ""),
            placeholder=f"such as {EXAMPLES[question.name]}",
            description=None,
            sizing_mode="stretch_width",
            margin=(2, 0, 0, 0),
        )
        field.param.watch(
            self.page.told(lambda event: self._answer(question.name, event.new)), "value"
        )
        problem = look.words(_hint(question))
        self._fields[question.name], self._problems[question.name] = field, problem
        return pn.Column(field, problem, sizing_mode="stretch_width", margin=(0, 0, 6, 0))

    def _flags(self) -> list[pn.widgets.CheckBoxGroup]:
        if self._known.plant != "ehs":
            return []
        flags = (
            ("double_rod", "the rod is on both sides of the piston"),
            ("hoses", "hoses connect valve and cylinder"),
            ("drop_over_both", "the pressure drop is over both edges, P to A and B to T"),
        )
        boxes = []
        for name, words in flags:
            box = look.tick(words, getattr(self._known, name))
            box.param.watch(
                self.page.told(lambda event, name=name: self._set_flag(name, bool(event.new))),
                "value",
            )
            boxes.append(box)
        return boxes

    def _change_plant(self, event: Any) -> None:
        self._known.plant = event.new
        self._build()
        self._save()

    def _anew(self, event: Any) -> None:
        del event
        self.session.rig_file.unlink(missing_ok=True)
        self.session.save()
        self._build()

    def _set_flag(self, name: str, value: bool) -> None:
        setattr(self._known, name, value)
        self._save()

    def _answer(self, name: str, text: str) -> None:
        self._known.answers[name] = text
        self._save()

    def _save(self) -> None:
        """Keeps the answers; the rig file is written as soon as they make one."""
        entries = self._entries()
        if isinstance(entries, list):
            try:
                text = rig_file_text(self.session.name, self._known.plant, entries)
                with result_files(self.session.rig_file, "rig-new") as new:
                    write_text(new / RIG, text)
            except RigError:
                self.session.rig_file.unlink(missing_ok=True)
        else:
            self.session.rig_file.unlink(missing_ok=True)
        self.session.save()
        self._redraw()

    def _entries(self) -> list[Entry] | str:
        """Returns all values, or why the answers make no rig yet."""
        known = self._known
        names = [one.name for one in QUESTIONS[known.plant]]
        try:
            return answered(
                known.plant,
                {name: text for name, text in known.answers.items() if name in names},
                double_rod=known.double_rod,
                hoses=known.hoses,
                drop_over_both=known.drop_over_both,
            )
        except ValueError as error:
            return str(error)

    def _redraw(self) -> None:
        known, sizes = self._known, {}
        for question in QUESTIONS[known.plant]:
            text, problem = known.answers.get(question.name, ""), ""
            try:
                if text.strip():
                    sizes[question.name] = read_answer(known.plant, question.name, text).value
            except ValueError as error:
                problem = f'<p class="bad small" role="alert">{look.plain(error)}</p>'
            html = problem or _hint(question)
            if self._problems[question.name].object != html:
                self._problems[question.name].object = html
        if known.plant == "ehs":
            self._drawing.object = machine_svg(known.answers, sizes, double=known.double_rod)
        else:
            self._drawing.object = ""
        entries = self._entries()
        if isinstance(entries, str):
            text = f'<p class="soft">{look.plain(entries[0].upper() + entries[1:])}.</p>'
            self._values.object = text.replace("..", ".")
        else:
            self._values.object = _values(entries)

    def refresh(self) -> None:
        """Shows a rig file that was given as it is, and follows other pages."""
        answers = (self._known.plant, dict(self._known.answers), self._given_as_file)
        if answers != self._shown:
            first = self._shown is None
            self._shown = answers
            stale = any(f.value != answers[1].get(n, "") for n, f in self._fields.items())
            if not first and (stale or self._given_as_file):
                self._build()
        if not self._given_as_file:
            return
        try:
            rig = read_rig(self.session.rig_file)
        except RigError as error:
            self._values.object = look.error(str(error))
            return
        rows = [
            (_meaning(key), shown(key, value), _sigma(rig.uncertainty.get(key)))
            for key, value in rig.values.items()
        ]
        self._values.object = look.told(
            f"The rig file {rig.name} is used as it is.",
            Table("", ("value", "is", "1-sigma"), rows),
        )


def _origin(entry: Entry) -> str:
    return "given" if entry.given else f'<span class="soft">typical: {look.plain(entry.why)}</span>'


def _hint(question: Question) -> str:
    return f'<p class="soft small">{look.plain(question.why)}</p>' if question.why else ""


def _meaning(key: str) -> Tagged:
    """Returns the name of a value as the rig file has it, and what it means."""
    parameter = plant_parameters().get(key)
    return Tagged(key, "" if parameter is None else parameter.meaning)


def _sigma(share: float | None) -> str:
    return "" if share is None else f"± {100.0 * share:.3g} %"


def _values(entries: list[Entry]) -> str:
    rows = [
        (
            _meaning(entry.key),
            entry.shown,
            _sigma(entry.sigma),
            "given" if entry.given else Tagged(f"typical: {entry.why}", kind="soft"),
        )
        for entry in entries
    ]
    return (
        '<p><span class="good">✓</span> Saved as rig.toml, in SI units, with a comment on each '
        "value.</p>" + look.told(Table("", ("value", "is", "1-sigma", "origin"), rows))
    )
