# SPDX-License-Identifier: MIT
"""The page of a machine over months: its dated logs are fitted, and the history is shown."""

from __future__ import annotations

import shlex
from typing import Any
from urllib.parse import quote

import panel as pn

from ehsid.harness.show.page import Table
from ehsid.harness.show.watch_page import CHANGES, change_rows, watch_lead

from . import look
from .histories import NUMBERS, PAGE, Histories, HistoryChoice
from .jobs import State
from .page import View, argument
from .session import RIG
from .steps.step import progress

LOOK_MS = 1000  # between two looks at the work
NEW, BESIDE = "+ new history", "rig.toml beside the logs"
FILES = {PAGE: "the page, to be sent and read without ehsid", NUMBERS: "all numbers"}


class HistoryView(View):
    """The page; it belongs to that of the machines."""

    key = "machines"
    title = "A machine over months"
    purpose = (
        "Dated logs of a machine become one history: what changed, when, and how small a change "
        "would have shown. A log that is in the history is not fitted again."
    )

    def __init__(self, histories: Histories) -> None:
        super().__init__(histories.workbench)
        self._histories = histories
        self._shown = look.select("history")
        self._logs = look.text_input(
            "folder of dated logs", placeholder="with logs such as 2026-03-17.csv"
        )
        self._rig = look.select("rig file")
        self._out = look.text_input(
            "folder of the history, if elsewhere", placeholder="--out of ehsid watch"
        )
        self._start = self.button("Fit the new logs", primary=True)
        self._start.on_click(self.told(self._do_start))
        self._stop = self.button("Stop")
        self._stop.on_click(self.told(self._do_stop))
        open_it = self.button("Only show the history")
        open_it.on_click(self.told(self._open))
        self._status, self._result = look.words(""), look.words("")
        self.layout.objects = [
            look.in_columns(self._shown, self._logs, self._rig, self._out, least="19rem"),
            pn.FlexBox(self._start, self._stop, open_it),
            self._status,
            self._result,
        ]
        asked, names = argument("name"), histories.names()
        self._choose(asked if asked in names else next(iter(names), NEW))
        self._shown.param.watch(self.told(lambda event: self._choose(event.new)), "value")
        look_again = self.told(self.refresh, keep=True)
        pn.state.add_periodic_callback(look_again, period=LOOK_MS)

    def _choose(self, name: str) -> None:
        """Shows a history, with what it is made of in the fields."""
        choice = self._histories.choice(name)
        rigs = [one for one in self.workbench.names() if self._has_rig(one)]
        self._rig.options = {BESIDE: "", **{f"that of machine {one}": one for one in rigs}}
        self._rig.value = choice.machine if choice.machine in rigs else ""
        self._logs.value, self._out.value = choice.logs, choice.out
        self._shown.options = [*self._histories.names(), NEW]
        self._shown.value = name
        self.refresh()

    def _has_rig(self, machine: str) -> bool:
        return (self.workbench.folder / machine / RIG).exists()

    def _do_start(self, _event: Any) -> None:
        choice = HistoryChoice(self._logs.value, self._rig.value, self._out.value)
        self._choose(self._histories.start(choice))

    def _do_stop(self, _event: Any) -> None:
        self._histories.stop(self._shown.value)
        self._stop.param.update(name="Stopping behind the next log", disabled=True)

    def _open(self, _event: Any) -> None:
        self._choose(self._histories.show(self._out.value))

    def refresh(self) -> None:
        """Shows how the work goes, and what the history tells."""
        name = self._shown.value
        job = self._histories.job(name)
        running = job is not None and job.running
        self._start.disabled, self._stop.visible = running, running
        if not running:
            self._stop.param.update(name="Stop", disabled=False)
        status = progress(job)
        if job is not None and job.state is State.done:
            status = f'<p role="status">{look.plain(job.stage)}</p>'
        if self._status.object != status:
            self._status.object = status
        html = self._found(name)
        if self._result.object != html:
            self._result.object = html

    def _found(self, name: str) -> str:
        page = self._histories.result(name) / PAGE
        watch = self._histories.told(name)
        if watch is None or not page.is_file():
            return ""
        rows = change_rows(watch)
        address = f"/history-result/{quote(name)}"
        return (
            (look.told(Table("", CHANGES, rows)) if rows else "")
            + f'<iframe src="{address}/{PAGE}?made={page.stat().st_mtime_ns}" title="History of '
            f'{look.plain(name)}"></iframe>{look.files(address, FILES)}{self._same(name)}'
        )

    def _same(self, name: str) -> str:
        """Returns the command that does the same, as far as there is one."""
        choice = self._histories.choice(name)
        if not choice.logs:
            return ""
        rig = ""
        if choice.machine:
            rig = f"{shlex.join(['cp', f'{choice.machine}/{RIG}', choice.logs])}\n"
        words = ["ehsid", "watch", choice.logs, "--out", str(self._histories.result(name))]
        return f"<pre>{look.plain(rig + shlex.join(words))}</pre>"


def histories_html(histories: Histories, theme: str) -> str:
    """Returns the histories in a list, each with what it tells."""
    items = ""
    for name in histories.names():
        watch = histories.told(name)
        words = "nothing is fitted yet"
        if watch is not None:
            count = len(change_rows(watch)) or "No"
            words = f"{watch_lead(watch)[0]} {count} change{'' if count == 1 else 's'}."
        address = f"/history?name={quote(name)}&amp;theme={theme}"
        items += f'<li><a href="{address}">{look.plain(name)}</a>: {look.plain(words)}</li>'
    address = f"/history?name={quote(NEW)}&amp;theme={theme}"
    return (
        f"<h2>Machines over months</h2><p>What changed, and when, as dated logs tell it.</p>"
        f'<ul>{items}</ul><p><a href="{address}">Begin a new history</a></p>'
    )
