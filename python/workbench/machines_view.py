# SPDX-License-Identifier: MIT
"""The page of all machines: a table to be sorted, and their names."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from urllib.parse import quote

import panel as pn

from ehsid.harness.show.units import percent

from . import look
from .histories import Histories
from .history_view import histories_html
from .machines import MachineRow, machine_rows
from .page import NEW, View
from .workbench import REMOVED

LOOK_MS = 3000  # between two looks for what has changed
# Heading of each column, and whether it has numbers.
COLUMNS = (
    ("machine", False),
    ("records", True),
    ("verdict", False),
    ("gap before", True),
    ("gap after", True),
    ("largest part", False),
    ("diagnosed", True),
)


class MachinesView(View):
    """The page."""

    key = "machines"
    title = "Machines"
    purpose = "All machines of this folder side by side. Click on a heading to sort by it."

    def __init__(self, histories: Histories) -> None:
        super().__init__(histories.workbench)
        self._histories = histories
        self._table, self._lives = look.words(""), look.words("")
        self._chosen = look.select("machine", width=280)
        self._chosen.param.watch(self.told(lambda event: self._ask(False)), "value")
        self._name = look.text_input("new name", placeholder="such as press_7", width=280)
        rename = self.button("Rename")
        rename.on_click(self.told(self._rename))
        self._remove = self.button("Remove")
        self._remove.on_click(self.told(lambda event: self._ask(True)))
        self._question = look.words("")
        self._yes = self.button("Yes, remove it", primary=True)
        self._yes.on_click(self.told(self._do_remove))
        self._no = self.button("Keep it")
        self._no.on_click(self.told(lambda event: self._ask(False)))
        self._changes = pn.Column(
            look.words("<h2>Rename or remove</h2>"),
            pn.FlexBox(self._chosen, self._name),
            pn.FlexBox(rename, self._remove),
            self._question,
            pn.FlexBox(self._yes, self._no),
            sizing_mode="stretch_width",
        )
        self.layout.objects = [self._table, self._lives, self._changes]
        self._ask(False)
        look_again = self.told(self.refresh, keep=True)
        look_again()
        pn.state.add_periodic_callback(look_again, period=LOOK_MS)

    def _rename(self, _event: Any) -> None:
        before, new_name = self._chosen.value, self._name.value
        made = self.workbench.rename(before, new_name)
        self._name.value = ""
        self.refresh()
        self._chosen.value = made
        self.say(f"{look.plain(before)} is now called {look.plain(made)}.")

    def _ask(self, asked: bool) -> None:
        """Shows or hides the question that comes before a machine is removed."""
        self._yes.visible = self._no.visible = asked
        self._remove.visible = not asked
        name = look.plain(self._chosen.value)
        self._question.object = (
            f"<p>Remove <b>{name}</b> from this list? Its folder is moved into the folder "
            f"<code>{REMOVED}</code>; nothing is deleted.</p>"
            if asked
            else ""
        )

    def _do_remove(self, _event: Any) -> None:
        name = self._chosen.value
        place = self.workbench.remove(name)
        self._ask(False)
        self.refresh()
        self.say(
            f"{look.plain(name)} is removed. Its folder is now <code>{look.plain(place)}</code>: "
            "to have it back, move it one folder up."
        )

    def refresh(self) -> None:
        """Shows what has changed; an open question stays."""
        rows = machine_rows(self.workbench)
        html = table_html(rows, self.theme)
        if self._table.object != html:
            self._table.object = html
        lives = histories_html(self._histories, self.theme)
        if self._lives.object != lives:
            self._lives.object = lives
        names = [row.name for row in rows]
        if self._chosen.options != names:
            kept = self._chosen.value if self._chosen.value in names else None
            self._chosen.options = names
            self._chosen.value = kept or (names[0] if names else None)
        self._changes.visible = bool(names)


def table_html(rows: list[MachineRow], theme: str) -> str:
    """Returns the machines as a table that is sorted where it is shown."""
    new = f'<p><a href="/?session={quote(NEW)}&amp;theme={theme}">Begin a new machine</a></p>'
    if not rows:
        return f"<p>There is no machine in this folder yet.</p>{new}"
    head = "".join(
        f'<th{" class=n" if number else ""}><button class="sort" '
        f'onclick="ehsidSort(this)">{words}</button></th>'
        for words, number in COLUMNS
    )
    body = "".join(f"<tr>{''.join(_cells(row, theme))}</tr>" for row in rows)
    return (
        f'<div class="scroll" tabindex="0" aria-label="All machines"><table class="sorted"><thead>'
        f"<tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
        '<p class="soft small">The gap is the error of the simulation on data that were held out, '
        "as a share of the motion (nrmse): before with the rig as it was, after with what the "
        f"diagnosis found.</p>{new}"
    )


def _cells(row: MachineRow, theme: str) -> list[str]:
    address = f"/?session={quote(row.name)}&amp;theme={theme}"
    stale = (
        ""
        if row.holds or row.made is None
        else ('<br><span class="bad small">Records or rig have changed since.</span>')
    )
    made = "" if row.made is None else datetime.fromtimestamp(row.made).strftime("%Y-%m-%d %H:%M")
    part = f"{look.plain(row.where)}, {percent(row.share)}" if row.where else "–"
    cells = [
        (f'<a href="{address}">{look.plain(row.name)}</a>', row.name),
        ("–" if row.records is None else str(row.records), row.records),
        (look.plain(row.verdict) + stale, row.verdict),
        (percent(row.before), row.before),
        (percent(row.after), row.after),
        (part, row.where),
        (made or "–", row.made),
    ]
    return [
        f'<td{" class=n" if number else ""} data-label="{words}" '
        f'data-key="{"" if key is None else look.plain(key)}">{html}</td>'
        for (html, key), (words, number) in zip(cells, COLUMNS, strict=True)
    ]
