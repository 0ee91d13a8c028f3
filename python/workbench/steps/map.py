# SPDX-License-Identifier: MIT
"""Map: which column is which signal, in which unit; guessed, shown, and to be corrected."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import panel as pn

from ehsid.harness.catalogue.channels import CHANNELS, COMMAND, POSITION, TIME
from ehsid.harness.records.mapping import parse_maps

from .. import look
from ..downsampling import opened
from ..plots import Line, Panel, stacked
from ..reading import MADE, Reading, read_alike, reading_of
from ..session import Entry
from .step import StepView, progress

GUESS = "as guessed"
UNITS = {
    "s": ["s", "ms", "us"],
    "V": ["V", "mV", "mA", "%"],
    "m": ["m", "mm", "cm", "inch", "um"],
    "Pa": ["bar", "barg", "MPa", "kPa", "Pa", "psi", "psig"],
    "1": ["1", "%"],
    "m/s": ["m/s", "mm/s"],
    "N": ["N", "kN"],
    "degC": ["degC", "degF", "kelvin"],
}
AS_LOGGED = "as logged"


class MapStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._chosen = look.select("record", width=260)
        self._held_out = look.tick(
            "hold this record out: the diagnosis judges by it and never fits it", False
        )
        self._held_out.margin = (22, 8, 4, 0)
        self._dt = look.text_input("sampling time in ms (empty: as in the log)", width=260)
        self._status = look.words("")
        self._columns = look.words("")
        self._rows = look.Sheets({})
        self._read = look.words("")
        self._plots = pn.Column(sizing_mode="stretch_width")
        self._shown: object = None
        self._quiet = False
        self._chosen.param.watch(page.told(lambda event: self._choose()), "value")
        self._held_out.param.watch(
            page.told(lambda event: self._hold_out(bool(event.new))), "value"
        )
        self._dt.param.watch(page.told(lambda event: self._set_step(event.new)), "value")
        signals = [self._status, self._columns, self._rows.layout, self._dt]
        read = [look.beside(self._chosen, self._held_out), self._read, self._plots]
        self.layout.objects = [look.panes(signals, read)]

    def _entry(self) -> Entry | None:
        return self.session.entry(self._chosen.value or "")

    def _choose(self) -> None:
        self._shown = None
        self.refresh()

    def _hold_out(self, value: bool) -> None:
        entry = self._entry()
        if entry is not None and not self._quiet:
            entry.held_out = value
            self.session.save()

    def _set_step(self, text: str) -> None:
        entry = self._entry()
        if entry is None or self._quiet:
            return
        step = None
        if text.strip():
            try:
                step = 1e-3 * float(text.replace(",", "."))
            except ValueError:
                step = -1.0
            if not 0.0 < step < 1e3:
                raise ValueError(
                    f"sampling time {text!r}: expected a number of milliseconds above 0, such as 1"
                )
        entry.dt_s = step
        self._reread(entry)

    def _set_map(self, channel: str, column: str, unit: str) -> None:
        entry = self._entry()
        if entry is None or self._quiet:
            return
        # The runs of one logger have the same columns: one choice is enough for all of them.
        alike = read_alike(self.session, entry)
        if column == GUESS:
            entry.maps.pop(channel, None)
        else:
            text = column if unit == AS_LOGGED else f"{column} [{unit}]"
            parse_maps([f"{channel}={text}"], "column")
            entry.maps[channel] = text
        for other in alike:
            other.maps = dict(entry.maps)
        self._reread(entry, *alike)

    def _reread(self, *entries: Entry) -> None:
        self.session.save()
        for entry in entries:
            self.workbench.read(self.session, entry)

    def refresh(self) -> None:
        """Shows how the chosen record was read."""
        self._status.object = progress(self.workbench.job(self.session, "read"))
        self._offer_records()
        entry = self._entry()
        if entry is None:
            return
        reading = reading_of(self.session, entry)
        if reading is None or (
            reading.told != entry.told() and not self.workbench.is_reading(self.session)
        ):
            self.workbench.read(self.session, entry)
        shown = (entry.id, reading)
        if reading is None or shown == self._shown:
            return
        self._shown = shown
        self._quiet = True
        self._held_out.value = [True] * entry.held_out
        self._dt.value = "" if entry.dt_s is None else f"{1e3 * entry.dt_s:.12g}"
        self._quiet = False
        self._columns.object = _columns(reading, read_alike(self.session, entry))
        needed = {TIME, COMMAND, POSITION, *reading.channels, *entry.maps}
        sheets: dict[str, list[pn.FlexBox]] = {"Signals": [], "Signals that are not logged": []}
        for channel in CHANNELS:
            place = "Signals" if channel in needed else "Signals that are not logged"
            sheets[place].append(self._row(channel, entry, reading))
        self._rows.show(sheets)
        self._read.object = _how_read(reading)
        self._draw(entry, reading)

    def _offer_records(self) -> None:
        """Follows the records of the session, to which other pages and uploads add."""
        names = [entry.id for entry in self.session.settings.records]
        if names != self._chosen.options:
            kept = self._chosen.value if self._chosen.value in names else next(iter(names), None)
            self._chosen.param.update(options=names, value=kept)
        self._chosen.visible = self._held_out.visible = len(names) > 1

    def _row(self, channel: str, entry: Entry, reading: Reading) -> pn.FlexBox:
        about = CHANNELS[channel]
        mapped = entry.maps.get(channel, "")
        name, unit = _split(mapped)
        names = [column.name for column in reading.columns]
        column = look.select(
            about.words,
            options=[GUESS, *dict.fromkeys([*names, *([name] if name else [])])],
            value=name or GUESS,
            width=168,
            margin=(2, 8, 2, 0),
            tags=[f"column of {channel}"],  # by which a column that is dropped finds it
        )
        units = [AS_LOGGED, *UNITS[about.unit], *([unit] if unit else [])]
        of = look.select(
            "unit",
            options=list(dict.fromkeys(units)),
            value=unit or AS_LOGGED,
            width=132,
            margin=(2, 12, 2, 0),
            disabled=not name,
        )
        changed = self.page.told(lambda event: self._set_map(channel, column.value, of.value))
        column.param.watch(changed, "value")
        of.param.watch(changed, "value")
        text = look.words(
            f'<p class="small target" ondragover="ehsidOver(event)" ondragleave="ehsidLeft(event)" '
            f"ondrop=\"ehsidTake(event, 'column of {channel}')\">{_taken(channel, reading)}</p>"
        )
        text.sizing_mode = None
        text.styles = {"flex": "1 1 14rem", "width": "auto"}
        return pn.FlexBox(column, of, text, align_items="end", sizing_mode="stretch_width")

    def _draw(self, entry: Entry, reading: Reading) -> None:
        if reading.problem or not reading.channels:
            self._plots.objects = []
            return
        folder = self.session.look_of(entry)
        kept = {channel: unit for _, channel, unit, _, _ in reading.taken if channel == COMMAND}
        panels: dict[str, list[Line]] = {}
        for number, channel in enumerate(reading.channels):
            about = CHANNELS.get(channel)
            if about is None or channel == TIME:
                continue
            line = Line(about.words, opened(folder, f"{MADE}_{number}"), about.factor)
            kind = "pressure" if about.unit == "Pa" else about.words
            unit = kept.get(channel, about.shown_unit)  # a command keeps its numbers
            panels.setdefault(f"{kind} in {unit}", []).append(line)
        if not panels:
            self._plots.objects = []
            return
        time_s = None
        if reading.dt_s is not None:
            time_s = np.load(folder / f"{TIME}.npy", mmap_mode="r")
        drawn = [Panel(label, lines) for label, lines in panels.items()]
        axis = "sample" if time_s is None else "time in s"
        self._plots.objects = [stacked(drawn, time_s, self.page.theme, axis).layout]


def _split(text: str) -> tuple[str, str]:
    """Returns column and unit of a text such as "Stroke [mm]"."""
    if text.endswith("]") and " [" in text:
        name, _, unit = text[:-1].rpartition(" [")
        return name, unit
    return text, ""


def _columns(reading: Reading, alike: Sequence[Entry]) -> str:
    """Returns the columns of the log, each to be dragged to a signal, as HTML."""
    chips = "".join(
        f'<li draggable="true" data-column="{look.plain(column.name)}" '
        f'ondragstart="ehsidDrag(event)">{look.plain(column.name)}'
        f"{f' <small>{look.plain(column.unit)}</small>' if column.unit else ''}</li>"
        for column in reading.columns
    )
    names = ", ".join(look.plain(other.id) for other in alike)
    also = f" It holds for {names} too, whose columns have the same names." if alike else ""
    return (
        '<p class="soft small">Columns of the log. Drag one to the signal that it is, or choose it '
        f'there.{also}</p><ul class="chips">{chips}</ul>'
    )


def _taken(channel: str, reading: Reading) -> str:
    """Returns what was taken for a channel, as HTML."""
    for column, name, unit, factor, why in reading.taken:
        if name == channel:
            source = f"<b>{look.plain(column)}</b> in {look.plain(unit)}, times {factor}"
            return f'<span class="good">✓</span> {source}: {look.plain(why)}'
    if channel in reading.channels or (channel == TIME and reading.dt_s is not None):
        return '<span class="good">✓</span> has this name in the log already'
    if channel in (COMMAND, POSITION) or (channel == TIME and reading.dt_s is None):
        return '<span class="bad">not found: it is needed. Choose the column.</span>'
    return '<span class="soft">not in this log</span>'


def _how_read(reading: Reading) -> str:
    """Returns the problem, or what the record is, and the remarks, as HTML."""
    if reading.problem:
        return look.error(reading.problem)
    step = "no time" if reading.dt_s is None else f"every {1e3 * reading.dt_s:.6g} ms"
    pieces = f", in {reading.pieces} pieces without a gap" if reading.pieces > 1 else ""
    seconds = "" if reading.dt_s is None else f", {reading.samples * reading.dt_s:.4g} s in all"
    html = f"<p><b>{reading.samples} samples</b>, {step}{seconds}{pieces}.</p>"
    if reading.remarks:
        items = "".join(f"<li>{look.plain(remark)}</li>" for remark in reading.remarks)
        html += f"<h2>What was changed, left out or guessed</h2><ul>{items}</ul>"
    return html
