# SPDX-License-Identifier: MIT
"""The next experiment on the page: what it separates, its plots, and how to run it."""

from __future__ import annotations

from pathlib import Path

from bokeh.models import Column

from ehsid.harness.catalogue.channels import CHANNELS, COMMAND, POSITION
from ehsid.harness.diagnosis.schema import NEXT_EXPERIMENT, NextExperiment
from ehsid.harness.records import read_record
from ehsid.harness.show.next_words import again_command, experiment_steps, experiment_words

from .. import look
from ..downsampling import make_pyramid
from ..plots import Line, Panel, stacked
from ..session import Session

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
