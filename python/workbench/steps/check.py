# SPDX-License-Identifier: MIT
"""Check: what these records can and cannot show, before anything is fitted.

Gap: the diagnosis, with a time to go and to be cancelled, and its report.
"""

from __future__ import annotations

from typing import Any

import msgspec
import panel as pn

from ehsid.harness.base.encoding import read_json
from ehsid.harness.fitness.finding import RigCheckFile, WrittenCheck
from ehsid.harness.show.page import Block, Heading, Items, whole
from ehsid.harness.show.rig_check import check_table

from .. import look
from ..check_look import factors_plot, speeds_plot
from ..flow import step_states
from ..jobs import REMARKS, Said
from .next import SoFarView
from .step import StepView, progress


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
        self._made: str | None = None  # of which records and rig
        told = [pn.Row(self._again), self._status, self._result]
        self.layout.objects = [look.panes(told, [self._record, self._plots])]
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
        self._result.object = self._told(found, remarks)
        made = self.session.settings.made_of.get("check")
        if (found, made) != (self._found, self._made):
            self._found, self._made = found, made
            names = {one.record: number for number, one in enumerate(found.records)}
            self._record.param.update(options=names, value=0, visible=len(names) > 1)
            self._draw()

    def _draw(self) -> None:
        """Draws the chosen record."""
        if self._found is None or self._record.value is None:
            return
        number, theme = self._record.value, self.page.theme
        drawn = (
            factors_plot(self._found.records[number], theme),
            speeds_plot(self.session, number, theme),
        )
        self._plots.objects = [look.drawn(one) for one in drawn if one is not None]

    def _told(self, result: RigCheckFile, remarks: list[Said]) -> str:
        stale = step_states(self.session)["check"].why
        html = f'<p class="bad">{look.plain(stale)}</p>' if stale else ""
        html += _verdict(result, remarks)
        for check in result.records:
            html += _of_record(check, [one.what for one in remarks if one.record == check.record])
        between = [one.what for one in remarks if not one.record]
        return html + look.told(*_items("Between the records", between))


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


def _of_record(check: WrittenCheck, remarks: list[str]) -> str:
    notes = _items("To be known about this record", [*check.notes, *remarks])
    return look.told(Heading(check.record), check_table(check.findings), *notes)


def _items(title: str, items: list[str]) -> list[Block]:
    return [Heading(title), Items(list(dict.fromkeys(items)))] if items else []


FILE_WORDS = {
    "report.html": "report, to be sent and read without ehsid",
    "diagnosis.json": "all numbers",
    "simulation.csv": "measured and simulated, sample by sample",
    "rig.augmented.toml": "rig file with the values and effects that were found",
    "next_experiment.csv": "command of the next experiment",
}


class Sentence(msgspec.Struct):
    """What the page itself reads of a diagnosis."""

    sentence: str = ""


class GapStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._start = self.button("Start the diagnosis", primary=True)
        self._start.on_click(page.told(lambda event: self.workbench.diagnose(self.session)))
        self._cancel, self._status = self.follow("gap")
        self._plan, self._result, self._report = (look.words("") for _ in range(3))
        self._so_far = SoFarView(self.session.folder, page.theme)
        work = [
            self._plan,
            pn.Row(self._start, self._cancel),
            self._status,
            self._result,
            self._so_far.known,
        ]
        self.layout.objects = [look.panes(work, [self._so_far.plots, self._report], (2, 5))]

    def refresh(self) -> None:
        """Shows how the diagnosis goes, and what it found."""
        job = self.workbench.job(self.session, "gap")
        running = job is not None and job.running
        state = step_states(self.session)["gap"]
        self._start.disabled = running
        self._start.name = "Start the diagnosis again" if state.done else "Start the diagnosis"
        self._cancel.visible = running
        self._status.object = progress(job)
        entries = self.session.settings.records
        fitted = [entry.id for entry in entries if not entry.held_out]
        held_out = [entry.id for entry in entries if entry.held_out]
        judged = f"judged by {', '.join(held_out)}" if held_out else "judged by blocks held out"
        self._plan.object = (
            f"<p>Fitted: {look.plain(', '.join(fitted))}; {look.plain(judged)}. "
            '<span class="soft">It takes minutes. The page may be closed or reloaded meanwhile.'
            "</span></p>"
        )
        self._so_far.refresh(running=running)
        result, report = ("", "") if running else self._found(state.why)
        for part, html in ((self._result, result), (self._report, report)):
            if part.object != html:
                part.object = html

    def _found(self, why: str) -> tuple[str, str]:
        """Returns the sentence with the files, and the report, as HTML."""
        folder = self.session.folder / "gap"
        found = read_json(folder / "diagnosis.json", Sentence)
        if found is None:
            return "", ""
        stale = f'<p class="bad">{look.plain(why)}</p>' if why else ""
        address = f"/result/{self.session.name}/gap"
        there = {name: one for name, one in FILE_WORDS.items() if (folder / name).exists()}
        stamp = int((folder / "diagnosis.json").stat().st_mtime)
        return (
            f'{stale}<p class="verdict">{look.plain(whole(found.sentence))}</p>'
            f"{look.files(address, there)}",
            f'<iframe src="{address}/report.html?made={stamp}" title="Report of the diagnosis">'
            "</iframe>",
        )
