# SPDX-License-Identifier: MIT
"""Next: what to do with the diagnosis; the experiment, the rig, the header, and all as one file.

The next experiment on the page: what it separates, its plots, and how to run it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import panel as pn
from bokeh.models import Column

from ehsid.harness.catalogue.channels import CHANNELS, COMMAND, POSITION
from ehsid.harness.diagnosis.schema import (
    NEXT_EXPERIMENT,
    DiagnosisFile,
    NextExperiment,
    read_diagnosis_file,
)
from ehsid.harness.records import read_record
from ehsid.harness.show.verdict_words import what_now
from ehsid.harness.show.which_section import (
    again_command,
    experiment_steps,
    experiment_words,
)

from .. import look
from ..adoption import as_new_machine, use_as_rig
from ..downsampling import make_pyramid
from ..plots import Line, Panel, stacked
from ..session import Session
from .controller import ControllerPart
from .identification import HeaderPart
from .rig import rig_changes_html
from .step import StepView, progress

LABELS = {COMMAND: "command in V", POSITION: "predicted position in mm"}


def experiment_words_html(coming: NextExperiment) -> str:
    """Returns what the experiment is and what it separates, as HTML."""
    text = experiment_words(coming.description, coming.separates, coming.power)
    return f"<h2>The next experiment</h2><p>{look.plain(text)}</p>"


def experiment_plots(folder: Path, theme: str) -> Column:
    """Returns plots of the command and of the predicted position over the time.

    Parameters
    ----------
    folder
        that of the diagnosis.
    theme
        key of `look.THEMES`.
    """
    record = read_record(folder / NEXT_EXPERIMENT, required=(COMMAND,))
    panels = [
        Panel(label, [Line(label, make_pyramid(record.columns[name]), CHANNELS[name].factor)])
        for name, label in LABELS.items()
        if name in record.columns
    ]
    return stacked(panels, record.time_s, theme, "time in s").layout


def experiment_steps_html(session: Session, coming: NextExperiment) -> str:
    """Returns how to run the experiment safely, as HTML, with the download of the command."""
    entries = session.settings.records
    fitted = [f"records/{entry.id}.parquet" for entry in entries if not entry.held_out]
    judged = [f"records/{entry.id}.parquet" for entry in entries if entry.held_out]
    steps = [
        *experiment_steps(coming.sensors),
        "Drop the new log on the step Load, beside the old ones, and diagnose again. In a "
        "terminal, with the new log as new.csv:",
    ]
    items = "".join(f"<li>{look.plain(step)}</li>" for step in steps)
    address = f"/result/{session.name}/gap/{NEXT_EXPERIMENT}?download=1"
    return (
        f'<p><a href="{address}">Download {NEXT_EXPERIMENT}</a>: time in s, command in V, and the '
        f"predicted position in m</p><ol>{items}</ol>"
        f"<pre>{look.plain(again_command(fitted, judged, 'rig.toml'))}</pre>"
    )


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
        self._controller = ControllerPart(self)
        self._header = HeaderPart(self)
        self._pack = self.button("Pack everything into one archive")
        self._pack.on_click(page.told(lambda event: self.workbench.pack(self.session)))
        self._shown: object = None
        adopted = [pn.FlexBox(self._adopt, self._begin), self._adopted]
        sheets = {
            "What to do": [look.panes([self._now, self._steps], [self._plots])],
            "The rig as found": [look.panes([self._rig], adopted)],
            "Controller": [self._controller.layout],
            "Firmware": [self._header.layout],
            "Report and archive": [self._files, pn.Row(self._pack), self._packing],
        }
        self.layout.objects = [look.Sheets(sheets).layout]

    def _use(self, _event: Any) -> None:
        kept = use_as_rig(self.session)
        self.page.show("rig")
        self.page.say(
            f"The rig that was found is now the rig of this machine; the one before is kept as "
            f"{kept}. Check and diagnosis belong to the rig before: run them again."
        )

    def _new_machine(self, _event: Any) -> None:
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
            self._controller.refresh()
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
