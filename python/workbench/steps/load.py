# SPDX-License-Identifier: MIT
"""Load: brings logs into the session, and draws their columns as they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import panel as pn

from ehsid.harness.records.kinds import ENDINGS
from ehsid.harness.show.page import Table

from .. import look
from ..downsampling import opened
from ..plots import Line, Panel, stacked
from ..reading import LogColumn, Reading, reading_of
from ..session import MOST_RECORDS, Entry, SessionError
from ..simulator_files import take_rig_at
from .step import StepView, progress

FIRST_SHOWN = 3  # columns that are drawn without being asked for
DROP = (
    '<label class="drop"><b>Drop logs here</b>, or choose files.<br>'
    '<span class="soft">CSV and other text, Excel, MAT, HDF5, MF4, TDMS, MCAP, ROS bag, Parquet; '
    "a rig file (TOML) and its simulator (FMU, Python), too. Up to 2 GiB each.</span>"
    '<input type="file" multiple aria-label="Choose logs" '
    'onchange="ehsidUpload(this.files)"></label>'
)


class LoadStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._path = look.text_input(
            "or the path of a log, a folder or a rig file on this machine",
            placeholder="/data/machine_7/run1.mf4",
            sizing_mode="stretch_width",
            max_width=560,
        )
        add = self.button("Add")
        add.align = "end"
        add.on_click(page.told(self._add_path))
        self._path.param.watch(page.told(self._add_path), "enter_pressed")
        self._status = look.words("")
        self._records = pn.Column(sizing_mode="stretch_width")
        self._chosen = look.select("record", width=260)
        self._columns = pn.widgets.CheckBoxGroup(
            name="columns to draw",
            inline=True,
            stylesheets=[look.CONTROLS],
            sizing_mode="stretch_width",
            margin=(4, 0),
        )
        self._plots = pn.Column(sizing_mode="stretch_width")
        self._about = look.words("")
        self._shown: object = None
        self._chosen.param.watch(page.told(lambda event: self._preview()), "value")
        self._columns.param.watch(page.told(lambda event: self._draw()), "value")
        for entry in self.session.settings.records:  # what a page that was closed has left
            if reading_of(self.session, entry) is None:
                self.workbench.read(self.session, entry)
        path = pn.Row(self._path, add, sizing_mode="stretch_width")
        logs = [look.words(DROP), path, self._status, self._records]
        drawn = look.Sheets({"Plots": [self._columns, self._plots], "Numbers": [self._about]})
        self.layout.objects = [look.panes(logs, [self._chosen, drawn.layout], (2, 3))]

    def _add_path(self, _event: Any) -> None:
        text = self._path.value.strip()
        if not text:
            return
        if text.lower().endswith(".toml"):
            self.page.say(take_rig_at(self.session, Path(text)))
        else:
            for path in _logs_at(Path(text).expanduser()):
                self.workbench.read(self.session, self.session.add(path))
        self._path.value = ""

    def refresh(self) -> None:
        """Shows the records, and what is known of them."""
        self._status.object = progress(self.workbench.job(self.session, "read"))
        entries = self.session.settings.records
        shown = [(entry.id, reading_of(self.session, entry)) for entry in entries]
        if shown == self._shown:
            return
        self._shown = shown
        self._records.objects = [self._line(entry) for entry in entries]
        names = [entry.id for entry in entries]
        self._chosen.param.update(
            options=names,
            value=self._chosen.value if self._chosen.value in names else next(iter(names), None),
            visible=len(names) > 1,
        )
        self._preview()

    def _line(self, entry: Entry) -> pn.FlexBox:
        reading = reading_of(self.session, entry)
        if reading is None:
            about = '<span class="soft">is being read</span>'
        elif not reading.kind:
            about = look.error(reading.problem)
        else:
            rows = max((column.size for column in reading.columns), default=0)
            about = f"{look.plain(reading.kind)}: {len(reading.columns)} columns, {rows} rows"
        remove = self.button(f"Remove {entry.id}")
        remove.on_click(self.page.told(lambda event: self._remove(entry)))
        text = look.words(f"<b>{look.plain(Path(entry.file).name)}</b><br>{about}")
        line = look.beside(text, remove, least="11rem")
        remove.styles = {"flex": "0 0 auto"}
        return line

    def _remove(self, entry: Entry) -> None:
        if entry in self.session.settings.records:
            self.session.remove(entry)

    def _reading(self) -> tuple[Entry | None, Reading | None]:
        entry = self.session.entry(self._chosen.value or "")
        return entry, None if entry is None else reading_of(self.session, entry)

    def _preview(self) -> None:
        _, reading = self._reading()
        drawn = [] if reading is None else [one for one in reading.columns if one.key]
        names = [_label(one) for one in drawn]
        first = [_label(one) for one in drawn if not _steady(one)][:FIRST_SHOWN]
        self._columns.param.update(options=names, value=first, visible=bool(names))
        self._draw()

    def _draw(self) -> None:
        entry, reading = self._reading()
        if entry is None or reading is None or not reading.columns:
            self._plots.objects, self._about.object = [], ""
            return
        folder = self.session.look_of(entry)
        panels = [
            Panel(_label(one), [Line(one.name, opened(folder, one.key))])
            for one in reading.columns
            if one.key and _label(one) in self._columns.value
        ]
        self._plots.objects = (
            [stacked(panels, None, self.page.theme, "row").layout] if panels else []
        )
        rows = [
            (one.name, one.unit, f"{one.size}", _number(one.low), _number(one.high))
            for one in reading.columns
        ]
        headings = ("column", "unit", "values", "smallest", "largest")
        self._about.object = look.told(Table("", headings, rows))


def _label(column: LogColumn) -> str:
    return f"{column.name} [{column.unit}]" if column.unit else column.name


def _steady(column: LogColumn) -> bool:
    """Whether a column is constant, or counts up as times and numbers of rows do by their name."""
    from ehsid.harness.records.names import is_counter, means

    same = column.low == column.high
    return same or means(column.name, "time_s") or is_counter(column.name)


def _number(value: float | None) -> str:
    return "no number" if value is None else f"{value:.6g}"


def _logs_at(path: Path) -> list[Path]:
    """Returns a log, or the logs in a folder.

    Raises
    ------
    SessionError
        there is nothing, or too much.
    """
    if not path.is_dir() or (path / "metadata.yaml").is_file():  # a ROS 2 bag is a folder
        return [path]
    endings = tuple(f".{ending}" for ending in ENDINGS)
    logs = sorted(file for file in path.iterdir() if file.name.lower().endswith(endings))
    if not logs:
        raise SessionError(
            f"{path}: there is no log in this folder: expected files that end in "
            f"{', '.join(sorted(endings))}; name another folder, or the file itself"
        )
    if len(logs) > MOST_RECORDS:
        raise SessionError(
            f"{path}: there are {len(logs)} logs in this folder: expected {MOST_RECORDS} at most; "
            "name the files that belong to one machine"
        )
    return logs
