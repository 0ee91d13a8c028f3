# SPDX-License-Identifier: MIT
"""The models found so far: a table of them, and which are drawn beside the newest one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import panel as pn

from ehsid.harness.base.numbers import plain_number
from ehsid.harness.models.identification.candidates import DIVERGES
from ehsid.harness.show.page import Cell, Heading, Table, Tagged, cell_text

from .. import look
from ..model_look import Identified
from ..model_plots import DrawnModel, drawn_models
from .step import StepPage

MOST_BESIDE = 2  # that are drawn with the newest model: more are hard to tell apart


class ModelsFound:
    """The table, and the ticks of the earlier models; only shown where there are some."""

    def __init__(self, page: StepPage) -> None:
        self._page, self._choice = page, page.session.settings.model
        self._quiet = False
        self._table = look.words("")
        self._ticks = pn.widgets.CheckBoxGroup(
            inline=True, stylesheets=[look.CONTROLS], margin=(0, 0, 4, 0)
        )
        self._ticks.param.watch(page.told(self._choose), "value")
        self.layout = pn.Column(self._table, self._ticks, sizing_mode="stretch_width")

    def _choose(self, event: Any) -> None:
        if self._quiet:
            return
        before = self._choice.beside
        still = [number for number in before if number in event.new]
        added = [number for number in event.new if number not in before]
        self._choice.beside = (still + added)[-MOST_BESIDE:]
        self._page.session.save()

    def show(self, models: Sequence[Identified]) -> None:
        """Shows the models, the newest one in front."""
        others = models[1:]
        self.layout.visible = bool(others)
        if not others:
            return
        shown = look.told(Heading("Models found so far"), table(models))
        asked = " ".join([*notes(models), f"Draw with the newest one, at most {MOST_BESIDE}:"])
        self._table.object = f'<div class="tight">{shown}</div><p>{look.plain(asked)}</p>'
        offered = {f"model {one.number}": one.number for one in others if one.same_time(models[0])}
        self._quiet = True
        try:
            chosen = [number for number in self._choice.beside if number in offered.values()]
            self._ticks.param.update(options=offered, value=chosen)
        finally:
            self._quiet = False

    def drawn(self, models: Sequence[Identified]) -> list[DrawnModel]:
        """Returns the models to be drawn, the newest one in front."""
        return drawn_models(models, self._choice.beside)


def table(models: Sequence[Identified]) -> Table:
    """Returns the table of the models; the newest one is marked."""
    newest = models[0]
    several = any(one.record != newest.record for one in models)
    rows: list[list[Cell]] = []
    for one in models:
        passed = sum(cell.kind == "good" for cell in one.told.tests)
        of = len(one.told.tests)
        tests = Tagged(f"{passed} of {of}", kind="good" if passed == of else "bad")
        orders = f"{one.orders.na}, {one.orders.nb}, {one.orders.nk}"
        fits = [one.fit, one.here or "-"] if several else [one.fit]
        place = [one.record] if several else []
        rows.append([str(one.number), *place, orders, *fits, tests, _motion(one)])
    headings = ("record", "na, nb, nk", "fit", "here") if several else ("na, nb, nk", "fit")
    here = f"; here: the same on {newest.record}" if several else ""
    caption = f"fit: of the simulation, on the half that was not fitted, in %{here}"
    return Table(caption, ("model", *headings, "tests", "servo or slowest pole"), rows, [0])


def _motion(model: Identified) -> str:
    """Returns omega_n and xi of a servo, else the slowest pole that is no integrator."""
    servo = model.dynamics.servo
    if servo is not None:
        omega_n, xi = plain_number(servo.omega_n.value, 3), plain_number(servo.xi.value, 2)
        return f"omega_n {omega_n} rad/s, xi {xi}"
    rows = zip(model.dynamics.poles, model.told.roots.rows, strict=False)
    return next((f"z = {cell_text(row[1])}" for one, row in rows if not one.integrates), "none")


def notes(models: Sequence[Identified]) -> list[str]:
    """Returns what cannot be drawn of the earlier models with the newest one, in sentences."""
    newest, *others = models
    found: dict[str, list[str]] = {}
    for one in others:
        if not one.same_time(newest):
            why = "With another sampling time, nothing is drawn"
        elif not one.same_signals(newest):
            why = "With other signals, only poles and zeros are drawn"
        elif one.here == DIVERGES:
            why = "Where it diverges here, no simulation is drawn"
        else:
            continue
        found.setdefault(why, []).append(f"model {one.number}")
    return [f"{why}: {', '.join(names)}." for why, names in found.items()]
