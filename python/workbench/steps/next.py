# SPDX-License-Identifier: MIT
"""Next: what to do with the diagnosis; the experiment, the rig, the header, and all as one file."""

from __future__ import annotations

from typing import Any

import panel as pn

from ehsid.harness.diagnosis.schema import DiagnosisFile, read_diagnosis_file
from ehsid.harness.show.next_words import what_now

from .. import look
from ..adoption import as_new_machine, use_as_rig
from .header_part import HeaderPart
from .next_experiment import experiment_plots, experiment_steps_html, experiment_words_html
from .rig_changes import rig_changes_html
from .step import StepView, progress


class NextStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._now, self._steps, self._rig, self._adopted, self._files, self._packing = (
            look.words("") for _ in range(6)
        )
        self._plots = pn.Column(sizing_mode="stretch_width")
        self._adopt = self.button("Use it as the rig of this machine")
        self._adopt.on_click(page.told(self._use))
        self._begin = self.button("Begin a new machine with it")
        self._begin.on_click(page.told(self._new_machine))
        self._header = HeaderPart(self)
        self._pack = self.button("Pack everything into one archive")
        self._pack.on_click(page.told(lambda event: self.workbench.pack(self.session)))
        self._shown: object = None
        self.layout.objects = [
            self._now,
            self._plots,
            self._steps,
            self._rig,
            pn.FlexBox(self._adopt, self._begin),
            self._adopted,
            self._header.layout,
            self._files,
            pn.Row(self._pack),
            self._packing,
        ]

    def _use(self, event: Any) -> None:
        del event
        kept = use_as_rig(self.session)
        self.page.show("rig")
        self.page.say(
            f"The rig that was found is now the rig of this machine; the one before is kept as "
            f"{kept}. Check and diagnosis belong to the rig before: run them again."
        )

    def _new_machine(self, event: Any) -> None:
        del event
        made = as_new_machine(self.workbench, self.session).name
        self._adopted.object = (
            f'<p><span class="good">✓</span> The machine <b>{look.plain(made)}</b> has this rig, '
            f'and no records yet. <a href="?session={made}&amp;theme={self.page.theme}">Open it'
            "</a></p>"
        )

    def refresh(self) -> None:
        """Shows what was found, and how the work goes."""
        stamp = self.session.settings.made_of.get("gap"), self.session.digest(rig=True)
        if stamp != self._shown:
            self._shown = stamp
            self._show(read_diagnosis_file(self.session.folder / "gap" / "diagnosis.json"))
        self._header.refresh()
        self._show_package()

    def _show(self, found: DiagnosisFile) -> None:
        coming = found.which.next_experiment
        text = what_now(found.verdict, experiment=coming is not None)
        self._now.object = (
            f'<p class="verdict">{look.plain(found.sentence)}</p>'
            f"<h2>What to do now</h2><p>{look.plain(text)}</p>"
        )
        folder, address = self.session.folder / "gap", f"/result/{self.session.name}/gap"
        self._plots.objects = []
        self._steps.object = ""
        if coming is not None:
            self._now.object += experiment_words_html(coming)
            self._plots.objects = [experiment_plots(folder, self.page.theme)]
            self._steps.object = experiment_steps_html(self.session, coming)
        self._rig.object = rig_changes_html(
            self.session.rig_file, folder / "rig.augmented.toml", found
        ) + (
            f'<p><a href="{address}/rig.augmented.toml?download=1">Download rig.augmented.toml'
            '</a></p><p class="soft">As the rig of this machine it replaces the one of today, '
            "which is kept beside it. Check and diagnosis then have to be run again, best with a "
            "new record.</p>"
        )
        self._files.object = (
            "<h2>To be sent and kept</h2>"
            f'<p><a href="{address}/report.html?download=1">Download the report</a>: one file, to '
            "be read in any browser without ehsid and without a network.</p>"
            "<p>The archive has the rig, the records, all results, and the logs that were dropped "
            "on the page. Unpacked into a folder of machines, it opens again.</p>"
        )

    def _show_package(self) -> None:
        job = self.workbench.job(self.session, "package")
        running = job is not None and job.running
        self._pack.disabled = running
        html = progress(job)
        archive = self.session.folder / "package" / f"{self.session.name}.zip"
        if not running and archive.exists():
            size = archive.stat().st_size
            html += (
                f'<p><a href="/result/{self.session.name}/package/{archive.name}?download=1">'
                f"Download {archive.name}</a>, {megabytes(size)}</p>"
            )
        if self._packing.object != html:
            self._packing.object = html


def megabytes(size: int) -> str:
    """Returns the size of a file as people say it."""
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.0f} kB"
