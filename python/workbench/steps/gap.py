# SPDX-License-Identifier: MIT
"""Gap: the diagnosis, with a time to go and to be cancelled, and its report."""

from __future__ import annotations

from typing import Any

import msgspec
import panel as pn

from ehsid.harness.base.encoding import read_json

from .. import look
from ..flow import standings
from .so_far import SoFarView
from .step import StepView, progress

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
        self._plan, self._result = look.words(""), look.words("")
        self._so_far = SoFarView(self.session.folder, page.theme)
        self.layout.objects = [
            self._plan,
            pn.Row(self._start, self._cancel),
            self._status,
            self._so_far.layout,
            self._result,
        ]

    def refresh(self) -> None:
        """Shows how the diagnosis goes, and what it found."""
        job = self.workbench.job(self.session, "gap")
        running = job is not None and job.running
        standing = standings(self.session)["gap"]
        self._start.disabled = running
        self._start.name = "Start the diagnosis again" if standing.done else "Start the diagnosis"
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
        html = "" if running else self._found(standing.why)
        if self._result.object != html:
            self._result.object = html

    def _found(self, why: str) -> str:
        folder = self.session.folder / "gap"
        found = read_json(folder / "diagnosis.json", Sentence)
        if found is None:
            return ""
        stale = f'<p class="bad">{look.plain(why)}</p>' if why else ""
        address = f"/result/{self.session.name}/gap"
        there = {name: one for name, one in FILE_WORDS.items() if (folder / name).exists()}
        stamp = int((folder / "diagnosis.json").stat().st_mtime)
        return (
            f'{stale}<p class="verdict">{look.plain(found.sentence)}</p>'
            f"{look.files(address, there)}"
            f'<iframe src="{address}/report.html?made={stamp}" title="Report of the diagnosis">'
            "</iframe>"
        )
