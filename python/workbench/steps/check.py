# SPDX-License-Identifier: MIT
"""Check: what these records can and cannot show, before anything is fitted."""

from __future__ import annotations

from typing import Any

import panel as pn

from ehsid.harness.base.encoding import read_json
from ehsid.harness.fitness.finding import RigCheckFile
from ehsid.harness.show.page import Block, Heading, Items
from ehsid.harness.show.rig_check import check_table

from .. import look
from ..check_look import factors_plot, speeds_plot
from ..flow import step_states
from ..jobs import REMARKS, Said
from .step import StepView, progress

COMPARISONS, NOTES = "Comparisons", "To be known"


class CheckStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._again = self.button("Check again")
        self._again.on_click(page.told(lambda event: self.workbench.check(self.session)))
        self._status, self._result = look.words(""), look.words("")
        self._record = look.select("record", visible=False)
        self._record.param.watch(page.told(lambda event: self._draw()), "value")
        self._plots = pn.Column(sizing_mode="stretch_width")
        self._found: RigCheckFile | None = None
        self._said: list[Said] = []
        self._made: str | None = None  # of which records and rig
        self._table, self._notes = look.words(""), look.words("")
        self._sheets = look.Switch(self._turn)
        self._sheets.offer([COMPARISONS, NOTES])
        self._sheets.layout.sizing_mode = None
        row = pn.FlexBox(self._record, self._again, self._sheets.layout, align_items="end")
        told = [row, self._status, self._result, self._table, self._notes]
        self.layout.objects = [look.panes(told, [self._plots], (2, 1))]
        state = step_states(self.session)["check"]
        if state.open and not state.done:  # it takes seconds, and the step is for it
            self.workbench.check(self.session)

    def refresh(self) -> None:
        """Shows how the check goes, and what it found."""
        job = self.workbench.job(self.session, "check")
        self._status.object = progress(job)
        self._again.disabled = job is not None and job.running
        folder = self.session.folder
        found = read_json(folder / "check" / "rig_check.json", RigCheckFile)
        remarks = read_json(folder / REMARKS, list[Said])
        if found is None or remarks is None:
            return
        stale = step_states(self.session)["check"].why
        html = f'<p class="bad">{look.plain(stale)}</p>' if stale else ""
        self._result.object = html + _verdict(found, remarks)
        made = self.session.settings.made_of.get("check")
        if (found, made) != (self._found, self._made):
            self._found, self._made = found, made
            names = {one.record: number for number, one in enumerate(found.records)}
            self._record.param.update(options=names, value=0, visible=len(names) > 1)
            self._said = remarks
            self._draw()

    def _turn(self) -> None:
        """Shows the sheet that was chosen."""
        self._notes.visible = self._sheets.chosen.startswith(NOTES)
        self._table.visible = not self._notes.visible

    def _draw(self) -> None:
        """Shows the chosen record."""
        if self._found is None or self._record.value is None:
            return
        number, theme = self._record.value, self.page.theme
        check = self._found.records[number]
        self._table.object = look.told(check_table(check.findings))
        own, between = (
            [one.what for one in self._said if one.record == name] for name in (check.record, "")
        )
        notes = [
            *_items("About this record", [*check.notes, *own]),
            *_items("Between the records", between),
        ]
        self._notes.object = look.told(*(notes or ["Nothing more."]))
        count = sum(len(one.items) for one in notes if isinstance(one, Items))
        names = [COMPARISONS, f"{NOTES}: {count}" if count else NOTES]
        chosen = names[self._notes.visible]
        self._sheets.offer(names)
        self._sheets.choose(chosen)
        drawn = (factors_plot(check, theme), speeds_plot(self.session, number, theme))
        self._plots.objects = [look.drawn(one) for one in drawn if one is not None]


def _verdict(result: RigCheckFile, remarks: list[Said]) -> str:
    wrong = [
        finding.check
        for check in result.records
        for finding in check.findings
        if finding.status == "does not fit"
    ]
    serious = [one.what for one in remarks if one.serious]
    if serious:
        return (
            '<p class="verdict">These records cannot carry a diagnosis: '
            f"{look.plain(' '.join(serious))}</p>"
        )
    if wrong:
        names = ", ".join(dict.fromkeys(wrong))
        return (
            f'<p class="verdict">{look.plain(names)}: rig and records do not fit each other. '
            "Correct the rig or the columns where the reason below names a mistake; a difference "
            "that the machine really has is for the diagnosis.</p>"
        )
    return '<p class="verdict">Nothing in the records contradicts the rig.</p>'


def _items(title: str, items: list[str]) -> list[Block]:
    return [Heading(title), Items(list(dict.fromkeys(items)))] if items else []
