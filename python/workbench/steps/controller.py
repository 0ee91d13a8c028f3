# SPDX-License-Identifier: MIT
"""Part of the step Next: valve tables and loop gains for the controller, from calm to fast."""

from __future__ import annotations

from typing import Any

import panel as pn

from ehsid.harness.base.files import result_folder
from ehsid.harness.commissioning import FILES, Design, design
from ehsid.harness.show.apply_page import told, write_apply
from ehsid.harness.show.page import Items, Note, Table

from .. import look
from .step import StepView

FOLDER = "apply"
WHY = (
    "<h2>For the controller</h2><p>Tables of the valve with their inverse, friction, and gains of "
    "the position loop, from what the diagnosis found. The margins hold in the worst case of all "
    "intervals; what the model cannot carry is refused with the reason.</p>"
)
FILE_WORDS = {
    "apply.html": "all of it as a page, with pictures",
    "apply.st": "constants and tables in Structured Text",
    "apply_twincat.st": "the same for TwinCAT",
    "apply.h": "the same for C99",
    "apply.toml": "the same as TOML",
    "constants.csv": "each number with interval, unit and source",
}


class ControllerPart:
    """A slider from calm to fast, what it gives, and the files."""

    def __init__(self, step: StepView) -> None:
        self._page, self._session = step.page, step.session
        self._speed = pn.widgets.FloatSlider(
            name="speed of the loop: 0 is calm, 1 the fastest that keeps its margins",
            start=0.0,
            end=1.0,
            step=0.05,
            value=0.5,
            stylesheets=[look.CONTROLS],
            sizing_mode="stretch_width",
            margin=(2, 12, 2, 0),
        )
        self._speed.param.watch(self._page.told(self._show), "value_throttled")
        self._make = step.button("Make the files for the controller")
        self._make.on_click(self._page.told(self._write))
        self._result, self._files = look.words(""), look.words("")
        self.layout = pn.Column(
            look.words(WHY),
            self._speed,
            self._result,
            pn.Row(self._make),
            self._files,
            sizing_mode="stretch_width",
        )

    def refresh(self) -> None:
        """Designs anew, for another diagnosis."""
        self._files.object = ""
        self._show(None)

    def _design(self) -> Design:
        return design([self._session.folder / "gap"], speed=self._speed.value)

    def _show(self, _event: Any) -> None:
        try:
            made = self._design()
        except ValueError as error:  # a verdict that nothing can be made of
            self._result.object = f"<p>{look.plain(error)}</p>"
            self._make.disabled = True
            return
        self._make.disabled = False
        self._result.object = f'<div class="tight">{look.told(_gains(made))}</div>' + look.told(
            Items(told(made.result))
        )

    def _write(self, _event: Any) -> None:
        folder = self._session.folder / FOLDER
        with result_folder(folder, "apply", FILES, [self._session.folder / "gap"]) as unfinished:
            write_apply(unfinished, self._design(), name="axis")
        self._files.object = look.files(f"/result/{self._session.name}/{FOLDER}", FILE_WORDS)


def _gains(made: Design) -> Table | Note:
    """The loops that are given, with their margins."""
    rows = [
        (
            name,
            f"{gains.pole:.3g} 1/s",
            f"{gains.position:.4g} V/m",
            f"{gains.worst.gain_db:.1f} dB, {gains.worst.phase_deg:.0f} degrees",
            f"{gains.fastest:.3g} 1/s",
        )
        for name, gains in (("P", made.gains), ("pole placement", made.placed))
        if gains is not None
    ]
    if not rows:
        return Note("No gains are given.")
    columns = ("loop", "decay of an error", "gain", "margins in the worst case", "fastest")
    return Table("", columns, rows)
