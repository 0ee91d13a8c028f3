# SPDX-License-Identifier: MIT
"""Rig: what is known of the machine, in the units of engineers; typical values fill the rest.

A drawing of the machine with the values of the form: cylinder, valve, supply and load.

The rig that a diagnosis found beside the rig before, as tables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import panel as pn

from ehsid.harness.base.error_words import printable
from ehsid.harness.base.files import result_files, write_text
from ehsid.harness.catalogue.channels import COMMAND
from ehsid.harness.catalogue.parameters import plant_parameters, value_name
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis.schema import DiagnosisFile
from ehsid.harness.rigs import Rig, RigError, read_rig
from ehsid.harness.rigs.carried import simulator_notes
from ehsid.harness.rigs.new import shown
from ehsid.harness.rigs.questions import (
    EXAMPLES,
    FULL,
    FULL_PERCENT,
    PERCENT,
    QUESTIONS,
    Question,
    answered,
    read_answer,
    rig_file_text,
)
from ehsid.harness.rigs.rig import table_words
from ehsid.harness.rigs.rig_file import Change, Entry, changes
from ehsid.harness.rigs.simulator_section import own_name
from ehsid.harness.show.gap_words import first_upper, quantity, unit_of
from ehsid.harness.show.page import Block, Cell, Folded, Heading, Items, Table, Tagged

from .. import look
from ..reading import reading_of
from ..session import RIG
from ..simulator_files import take_rig_at
from .step import StepView

WIDTH, HEIGHT = 560, 330


def machine_svg(answers: Mapping[str, str], sizes: Mapping[str, float], *, double: bool) -> str:
    """Returns the drawing of a servo as SVG.

    Parameters
    ----------
    answers
        what is written at the parts, by the names of the questions; "" is shown as "?".
    sizes
        bore, rod and stroke in metres, as far as they are known; the cylinder has their
        proportions.
    double
        whether the rod is on both sides.
    """
    bore = sizes.get("bore", 0.063)
    height = 64.0
    rod = height * min(max(sizes.get("rod", 0.5 * bore) / bore, 0.0), 0.95)
    length = min(max(height * sizes.get("stroke", 5.0 * bore) / bore, 110.0), 250.0)
    left, top = 70.0, 60.0
    piston, middle = left + 0.45 * length, top + 0.5 * height
    load = left + length + 60.0
    parts = [
        _box(left, top, length + 14, height, "var(--tint)"),
        _box(piston, top, 14, height, "var(--soft)"),
        _box(piston + 14, middle - 0.5 * rod, load - piston - 14, rod, "var(--line)"),
        _box(load, middle - 35, 70, 70, "var(--line)"),
        *([_box(left - 45, middle - 0.5 * rod, piston - left + 45, rod, "var(--line)")] * double),
        _line(left, top - 14, left + length, top - 14),
        _text(left + 0.5 * length, top - 20, f"stroke {_of(answers, 'stroke')}", "middle"),
        _text(left + 6, middle + 4, f"⌀ {_of(answers, 'bore')}"),
        _text(piston + 22, middle - 0.5 * rod - 5, f"⌀ {_of(answers, 'rod')}"),
        _text(load + 35, middle + 52, _of(answers, "mass"), "middle"),
        _text(load + 35, middle - 42, "load", "middle"),
    ]
    valve = left + 0.5 * length - 50
    bottom = top + height
    for x in (left + 12, left + length):
        end = valve + (20 if x == left + 12 else 80)
        parts.append(_path(f"M{x} {bottom} V{bottom + 22} H{end} V{bottom + 45}"))
    parts += [
        _box(valve, bottom + 45, 100, 36, "var(--tint)"),
        _text(valve + 50, bottom + 68, "valve", "middle"),
        _text(valve + 110, bottom + 59, f"{_of(answers, 'rated-flow')}"),
        _text(valve + 110, bottom + 77, f"at {_of(answers, 'rated-drop')}"),
        _text(valve - 8, bottom + 68, _of(answers, "rated-command"), "end"),
        _path(f"M{valve + 30} {bottom + 81} V{bottom + 110}"),
        _path(f"M{valve + 70} {bottom + 81} V{bottom + 110}"),
        _text(valve + 28, bottom + 128, f"P {_of(answers, 'supply')}", "end"),
        _text(valve + 72, bottom + 128, f"T {_of(answers, 'tank')}"),
    ]
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="Drawing of the machine" '
        f'style="width:100%;max-width:{WIDTH}px">{"".join(parts)}</svg>'
    )


def _of(answers: Mapping[str, str], name: str) -> str:
    return answers.get(name, "").strip()[:18] or "?"


def _box(x: float, y: float, width: float, height: float, fill: str) -> str:
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}" '
        'stroke="var(--ink)"/>'
    )


def _line(x: float, y: float, to_x: float, to_y: float) -> str:
    return f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}" stroke="var(--soft)"/>'


def _path(path: str) -> str:
    return f'<path d="{path}" fill="none" stroke="var(--ink)" stroke-width="1.5"/>'


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="var(--ink)">'
        f"{escape(printable(text))}</text>"
    )


# Of a value: smaller changes are nothing that a data sheet could say, and are not shown.
LEAST_CHANGE = 1e-3
COLUMNS = ("value", "before", "after", "change")


def rig_changes_html(before_file: Path, after_file: Path, found: DiagnosisFile) -> str:
    """Returns what the diagnosis made of the rig: what it added, and which values moved.

    Parameters
    ----------
    before_file, after_file
        the rig of the diagnosis, and the one that it wrote.
    found
        the diagnosis; it says which values moved more than by chance.
    """
    before, after = read_rig(before_file), read_rig(after_file)
    moved = {name for name, value in found.calibration.items() if value.moved}
    every = changes(before, after, least=LEAST_CHANGE)
    added = [one for one in every if one.before is None and not _is_nuisance(one)]
    fitted = [one for one in every if one.before is not None and not _is_nuisance(one)]
    hidden = [one for one in every if _is_nuisance(one)]
    blocks: list[Block] = [Heading("The rig with what was found")]
    laws = _laws(before, after)
    if added:
        blocks.append(_table("Added", added, moved))
    if laws:
        blocks += ["Added:", Items(laws)]
    if not (added or laws):
        blocks.append("No effect was added.")
    if fitted:
        caption = "Values that moved by 0.1 % or more"
        if any(one.key in moved for one in fitted):
            caption += "; marked: the change matters, and cannot be chance"
        blocks.append(_table(caption, fitted, moved))
    if hidden:
        title = f"What no data sheet states ({len(hidden)})"
        blocks.append(Folded(title, [_table("", hidden, moved)]))
    return look.told(*blocks)


def _is_nuisance(change: Change) -> bool:
    return ParameterKey(change.key).is_nuisance


def _table(caption: str, shown: list[Change], moved: set[str]) -> Table:
    rows = [
        (
            first_upper(value_name(one.key)),
            _shown(one.key, one.before),
            _shown(one.key, one.after),
            "" if one.share is None else f"{100.0 * one.share:+.2g} %",
        )
        for one in shown
    ]
    marked = [i for i, one in enumerate(shown) if one.key in moved]
    return Table(caption, COLUMNS, rows, marked)


def _shown(key: str, value: float | None) -> str:
    return "–" if value is None else quantity(value, unit_of(key))


def _laws(before: Rig, after: Rig) -> list[str]:
    """Returns the terms that have no name in the catalogue."""
    return [
        f"{name}: {table_words(law.adds_to, law.of)}, a table of {len(law.knots)} points"
        for name, law in after.tables.items()
        if name not in before.tables
    ]


OFTEN = ("rated-drop", "rated-command", "mass")  # known beside what is needed
TYPICAL = "Typical values"
SAVED = (
    '<p><span class="good">✓</span> Saved as rig.toml, in SI units, with a comment on each value. '
    f'What is not known has a typical value: see "{TYPICAL}".</p>'
)
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
        self._path = look.text_input(
            "the path of a rig file on this machine, if there is one",
            placeholder="/models/press/rig.toml; or drop the file here",
            sizing_mode="stretch_width",
            max_width=560,
        )
        self._path.param.watch(page.told(self._use_path), "enter_pressed")
        self._use = self.button("Use this rig file")
        self._use.align = "end"
        self._use.on_click(page.told(self._use_path))
        self._form = pn.Column(sizing_mode="stretch_width")
        self._drawing, self._saved, self._given, self._typical, self._values = (
            look.words("") for _ in range(5)
        )
        self._shown: object = None
        self._fill_in()
        self._build()

    @property
    def _given_as_file(self) -> bool:
        return self.session.rig_file.exists() and not any(self._known.answers.values())

    def _build(self) -> None:
        if self._given_as_file:
            anew = self.button("Describe the machine anew")
            anew.on_click(self.page.told(self._anew))
            self.layout.objects = [look.panes([anew], [self._values], (1, 5))]
            return
        self._fields, self._problems = {}, {}
        questions = QUESTIONS[self._known.plant]
        needed: list[pn.Column] = []
        often: list[pn.Column] = []
        further: list[pn.Column] = []
        for one in questions:
            place = needed if one.essential else often if one.name in OFTEN else further
            place.append(self._field(one))
        flags = self._flags()
        self._form.objects = [
            self._plant,
            pn.Row(self._path, self._use, sizing_mode="stretch_width"),
            look.words("<h2>Needed</h2>"),
            look.beside(*needed, least="13rem"),
            look.words("<h2>If known</h2>"),
            look.beside(*often, least="13rem"),
        ]
        sheets = {
            "Name plate": [look.panes([self._form], [self._drawing, self._saved, *flags], (3, 2))],
            "Further values, if known": [look.in_columns(*further, least="16rem")],
            "Given values": [self._given],
            TYPICAL: [self._typical],
        }
        self.layout.objects = [look.Sheets(sheets).layout]
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

    def _use_path(self, _event: Any) -> None:
        text = self._path.value.strip()
        if text:
            self.page.say(take_rig_at(self.session, Path(text)))
            self._path.value = ""

    def _anew(self, _event: Any) -> None:
        self.session.rig_file.unlink(missing_ok=True)
        self.session.save()
        self._build()

    def _set_flag(self, name: str, value: bool) -> None:
        setattr(self._known, name, value)
        self._save()

    def _answer(self, name: str, text: str) -> None:
        self._known.answers[name] = text
        self._save()

    def _fill_in(self) -> None:
        """Answers what the records tell: of a command in per cent, 100 is the full one."""
        asked = self._known.plant == "ehs" and FULL not in self._known.answers
        if not asked or self._given_as_file:
            return
        readings = (reading_of(self.session, one) for one in self.session.settings.records)
        if any(
            channel == COMMAND and unit == PERCENT
            for one in readings
            if one is not None
            for _, channel, unit, _, _ in one.taken
        ):
            self._known.answers[FULL] = FULL_PERCENT
            self.session.save()

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
            self._saved.object = text.replace("..", ".")
            self._given.object = self._typical.object = ""
        else:
            self._saved.object = SAVED
            self._given.object, self._typical.object = (
                _values([one for one in entries if one.given is given]) for given in (True, False)
            )

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
            (Tagged(key, _meaning(key)), shown(key, value), _uncertainty(rig, key))
            for key, value in rig.values.items()
        ]
        blocks: list[Block] = [f"The rig file {rig.name} is used as it is."]
        if rig.simulator is not None:
            blocks.append(f"Its simulator is yours: {rig.simulator.what}.")
        notes = [f"{first_upper(note)}." for note in simulator_notes(rig)]
        self._values.object = (
            look.told(*blocks)
            + _halves(("value", "is", "1-sigma"), rows)
            + look.told(*([Items(notes)] if notes else []))
        )


def _hint(question: Question) -> str:
    return f'<p class="soft small">{look.plain(question.why)}</p>' if question.why else ""


def _meaning(key: str) -> str:
    """Returns what a value of the rig file means."""
    parameter = plant_parameters().get(key)
    return "" if parameter is None else parameter.meaning


def _sigma(share: float | None) -> str:
    return "" if share is None else f"± {100.0 * share:.3g} %"


def _uncertainty(rig: Rig, key: str) -> str:
    """How well a value is known, of a simulator in its own unit unless it is a share."""
    own = None if rig.simulator is None else rig.simulator.parameters.get(own_name(key) or "")
    if own is None:
        return _sigma(rig.uncertainty.get(key))
    return _sigma(own.sigma) if own.log else f"± {own.sigma:.3g}"


def _values(entries: Sequence[Entry]) -> str:
    rows = [
        (
            entry.key,
            _meaning(entry.key),
            entry.shown,
            _sigma(entry.sigma),
            Tagged(entry.why, kind="soft"),
        )
        for entry in entries
    ]
    return look.told(Table("", ("value", "of", "is", "1-sigma", "reason"), rows))


def _halves(headings: tuple[str, ...], rows: Sequence[Sequence[Cell]]) -> str:
    """Returns a table in two halves, side by side where there is room."""
    middle = (len(rows) + 1) // 2
    halves = (look.told(Table("", headings, half)) for half in (rows[:middle], rows[middle:]))
    return f'<div class="halves">{"".join(f"<div>{half}</div>" for half in halves)}</div>'
