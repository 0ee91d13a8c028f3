# SPDX-License-Identifier: MIT
"""What all steps have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, Protocol

import panel as pn

from .. import look
from ..jobs import Job, State
from ..session import Session
from ..workbench import Workbench

P = ParamSpec("P")


class StepPage(Protocol):
    """What a step may use of the page that shows it; see `Page`."""

    workbench: Workbench
    session: Session
    theme: str
    key: str

    def told(self, handler: Callable[P, None]) -> Callable[P, None]:
        """Returns a handler whose errors are told on the page."""

    def say(self, text: str) -> None:
        """Shows above the step what was done."""

    def show(self, key: str) -> None:
        """Opens a step."""


class StepView:
    """A step on a page: `layout` is shown, and `refresh` brings it up to date."""

    button = staticmethod(look.button)

    def __init__(self, page: StepPage) -> None:
        self.page = page
        self.session = page.session
        self.workbench = page.workbench
        self.layout = pn.Column(sizing_mode="stretch_width")

    def refresh(self) -> None:
        """Shows what has changed in the session or its jobs."""

    def follow(self, job: str) -> tuple[pn.widgets.Button, pn.pane.HTML]:
        """Returns a button that cancels a job, and the place that says how the job goes."""
        cancel, status = self.button("Cancel"), look.words("")
        cancel.on_click(self.page.told(lambda event: self.workbench.cancel(self.session, job)))

        def tick() -> None:
            found = self.workbench.job(self.session, job)
            if found is not None and found.running:
                status.object = progress(found)

        # The time that has passed goes on although nothing is reported.
        pn.state.add_periodic_callback(tick, period=1000)
        return cancel, status


def progress(job: Job | None) -> str:
    """Returns how a job goes as HTML; "" without one, and where it came to a good end."""
    if job is None or job.state is State.done:
        return ""
    if job.state is State.cancelled:
        return '<p class="soft">Cancelled. Earlier results are unchanged.</p>'
    if not job.running:
        return look.error(job.message)
    left = "" if job.left_s is None else f", about {duration(job.left_s)} to go"
    share = 100.0 * job.share
    return (
        f'<p role="status">{look.plain(job.what)}: {share:.0f} %, {duration(job.seconds)} so far'
        f"{left}{f'; {look.plain(job.stage)}' if job.stage else ''}</p>"
        f'<div class="bar"><i style="width:{share:.1f}%"></i></div>'
    )


def duration(seconds: float) -> str:
    """Returns a duration as people say it; it is rounded so that it does not flicker."""
    if seconds < 60.0:
        return f"{5.0 * round(seconds / 5.0):.0f} s" if seconds >= 10.0 else f"{seconds:.0f} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes < 90.0 else f"{minutes / 60.0:.1f} h"
