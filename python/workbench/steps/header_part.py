# SPDX-License-Identifier: MIT
"""The part of the step Next that makes the header for the firmware."""

from __future__ import annotations

from typing import Any

import msgspec
import panel as pn

from ehsid.harness.base.encoding import from_json

from .. import look
from ..next_tasks import FIRMWARE, MADE, HeaderMade
from .step import StepView, progress

WHY = (
    "<h2>Header for the firmware</h2><p>It starts the recursive estimator of the firmware from a "
    "model of one record. Without a tick, offline identification chooses the orders na, nb and "
    "nk, and the forgetting policy f-ratio keeps what the start knows. The C++ header brings a "
    "self-test that the target can run.</p>"
)
LANGUAGES = {"C++17": False, "C99": True}


class HeaderPart:
    """Fields, button, progress and preview."""

    def __init__(self, step: StepView) -> None:
        self._page, self._session, self._workbench = step.page, step.session, step.workbench
        wish = self._session.settings.firmware
        ids = [entry.id for entry in self._session.settings.records]
        if wish.record not in ids:
            wish.record = ids[0] if ids else ""
        self._record = look.select("record of the model", options=ids, value=wish.record or None)
        self._language = look.select("language", options=LANGUAGES, value=wish.c)
        self._name = look.text_input("namespace in C++, prefix in C", value=wish.name)
        choice = self._session.settings.model
        self._like_model = look.tick(
            f"orders and forgetting of the step Model: na {choice.na}, nb {choice.nb}, "
            f"nk {choice.nk}, {choice.policy}",
            wish.like_model,
        )
        for field in (self._record, self._language, self._name, self._like_model):
            field.param.watch(self._page.told(self._choose), "value")
        self._make = step.button("Make the header")
        self._make.on_click(self._page.told(self._start))
        self._status, self._result = look.words(""), look.words("")
        fields = look.beside(self._record, self._language, self._name, least="11rem")
        self.layout = pn.Column(
            look.words(WHY),
            fields,
            self._like_model,
            pn.Row(self._make),
            self._status,
            self._result,
            sizing_mode="stretch_width",
        )

    def _choose(self, event: Any) -> None:
        del event
        wish = self._session.settings.firmware
        wish.record, wish.c = self._record.value or "", self._language.value
        wish.name, wish.like_model = self._name.value.strip(), bool(self._like_model.value)
        self._session.save()

    def _start(self, event: Any) -> None:
        from ehsid.harness.firmware import check_name

        self._choose(event)
        check_name(self._session.settings.firmware.name)
        self._workbench.make_header(self._session)

    def refresh(self) -> None:
        """Shows how the work goes, and the header."""
        job = self._workbench.job(self._session, "header")
        self._make.disabled = job is not None and job.running
        self._status.object = progress(job)
        html = self._preview()
        if self._result.object != html:
            self._result.object = html

    def _preview(self) -> str:
        folder = self._session.folder / FIRMWARE
        try:
            made = from_json((folder / MADE).read_bytes(), HeaderMade)
            text = (folder / made.file).read_text(encoding="utf-8")
        except (OSError, msgspec.DecodeError):
            return ""
        entry = self._session.entry(made.record)
        stale = ""
        if entry is None or entry.told() != made.told:
            stale = '<p class="bad">The record has changed since; make the header again.</p>'
        address = f"/result/{self._session.name}/{FIRMWARE}/{made.file}?download=1"
        return (
            f'{stale}<p><a href="{address}">Download {made.file}</a>, made of '
            f"{look.plain(made.record)}: {look.plain(made.summary)}</p>"
            f'<pre class="preview" tabindex="0" aria-label="Preview of the header">'
            f"{look.plain(text)}</pre>"
        )
