# SPDX-License-Identifier: MIT
"""One page in one browser tab: the steps beside the step that is open."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec

import panel as pn

from ehsid.harness.app import look
from ehsid.harness.app.equivalent import python, shown_commands
from ehsid.harness.app.flow import STEPS, next_step, standings
from ehsid.harness.app.session import Session
from ehsid.harness.app.steps.check import CheckStep
from ehsid.harness.app.steps.gap import GapStep
from ehsid.harness.app.steps.load import LoadStep
from ehsid.harness.app.steps.map import MapStep
from ehsid.harness.app.steps.model import ModelStep
from ehsid.harness.app.steps.rig import RigStep
from ehsid.harness.app.steps.step import StepView
from ehsid.harness.app.workbench import ERRORS, Workbench
from ehsid.harness.error_words import error_words

VIEWS: dict[str, type[StepView]] = {
    "load": LoadStep,
    "map": MapStep,
    "rig": RigStep,
    "check": CheckStep,
    "model": ModelStep,
    "gap": GapStep,
}
NEW = "+ new machine"

P = ParamSpec("P")


class Page:
    """A page on a session; other pages may show the same one.

    Attributes
    ----------
    session
        what it shows.
    theme
        key of `look.THEMES`.
    template
        what Panel serves.
    """

    def __init__(self, workbench: Workbench) -> None:
        self.workbench = workbench
        self.theme = "dark" if _argument("theme") == "dark" else "light"
        self.session = self._asked_for()
        self._steps = pn.Column(stylesheets=[look.STEPS], sizing_mode="stretch_width")
        self._step = pn.Column(sizing_mode="stretch_width")
        self._buttons = self._make_buttons()
        self._problem = look.words("")
        self._equivalent = look.words("")
        self._onward = pn.Row(margin=(10, 0))
        asked = _argument("step")
        found = standings(self.session)
        self.key = asked if asked in found and found[asked].open else next_step(self.session)
        self._view: StepView | None = None
        self._waiting = False
        self.template = self._make_template()
        document = pn.state.curdoc
        stop = self.session.listen(lambda: self._later(document))
        pn.state.on_session_destroyed(lambda context: stop())
        self.show(self.key)

    def _asked_for(self) -> Session:
        name = _argument("session")
        if name == NEW:
            return self.workbench.begun("")
        known = name in self.workbench.names()
        return self.workbench.opened(name) if known else self.workbench.latest()

    def _make_template(self) -> pn.Template:
        other = "light" if self.theme == "dark" else "dark"
        template = pn.Template(look.template())
        template.add_variable("session_name", self.session.name)
        template.add_variable("other_words", f"{other} colours")
        template.add_panel("sessions", self._make_sessions())
        template.add_panel("steps", self._steps)
        template.add_panel("step", self._step)
        template.title = f"{self.session.name} - ehsid"
        return template

    def _make_sessions(self) -> pn.widgets.Select:
        names = self.workbench.names()
        chosen = pn.widgets.Select(
            options=[*names, NEW], value=self.session.name, width=180, stylesheets=[look.CONTROLS],
            description="machine",
        )  # fmt: skip

        chosen.jscallback(value="ehsidGoTo({session: cb_obj.value, step: null})")
        return chosen

    def _make_buttons(self) -> dict[str, pn.widgets.Button]:
        buttons = {}
        for step in STEPS:
            button = pn.widgets.Button(
                sizing_mode="stretch_width",
                margin=0,
                stylesheets=[look.CONTROLS, look.STEP_BUTTON],
            )
            button.on_click(self.told(lambda event, key=step.key: self.show(key)))
            button.js_on_click(code=_noted(step.key))
            buttons[step.key] = button
        self._steps.objects = list(buttons.values())
        return buttons

    def told(self, handler: Callable[P, None]) -> Callable[P, None]:
        """Returns a handler whose errors are told on the page; it never shows a traceback."""

        @wraps(handler)
        def safely(*args: P.args, **kwargs: P.kwargs) -> None:
            try:
                self._problem.object = ""
                handler(*args, **kwargs)
            except Exception as error:
                self.tell(error)

        return safely

    def tell(self, error: Exception) -> None:
        """Shows an error above the step."""
        text = error_words(error)
        if text is None:
            log = self.session.folder / ERRORS
            with log.open("a", encoding="utf-8") as file:
                file.write(traceback.format_exc())
            text = (
                f"A fault of the program ({type(error).__name__}), which is not due to your data. "
                f"{log} has what its authors need to mend it. The session is as it was."
            )
        self._problem.object = look.error(text)

    def show(self, key: str) -> None:
        """Opens a step; one that is open stays as it is, so that no click on it is lost."""
        if self._view is not None and key == self.key:
            return
        self.key = key
        step = next(one for one in STEPS if one.key == key)
        title = look.words(f'<h1>{step.title}</h1><p class="soft">{step.purpose}</p>')
        self._onward.objects = []
        parts = [title, self._problem, self._onward, self._equivalent]
        try:
            self._view = VIEWS[key](self)
            parts.insert(2, self._view.layout)
        except Exception as error:
            self._view = None
            self.tell(error)
        self._step.objects = parts
        self.refresh()

    def _later(self, document: Any) -> None:
        """Refreshes the page in its own turn; many changes at once are shown together."""
        if not self._waiting and document.session_context is not None:
            self._waiting = True
            document.add_next_tick_callback(self.refresh)

    def refresh(self) -> None:
        """Shows what has changed."""
        self._waiting = False
        try:
            found = standings(self.session)
            for number, step in enumerate(STEPS, start=1):
                button, standing = self._buttons[step.key], found[step.key]
                mark = " ✓" if standing.done else ""
                button.name = f"{number}  {step.title}{mark}"
                button.disabled = not standing.open
                button.button_type = "primary" if step.key == self.key else "default"
            if self._view is not None:
                self._view.refresh()
            self._show_onward(found)
            self._show_equivalent()
        except Exception as error:
            self.tell(error)

    def _show_onward(self, found: dict[str, Any]) -> None:
        keys = [step.key for step in STEPS]
        place = keys.index(self.key)
        if place + 1 == len(keys):
            self._onward.objects = []
            return
        following = STEPS[place + 1]
        if not found[following.key].open:
            lacks = found[self.key].why
            text = f'<p class="soft">{following.title} opens next: {look.plain(lacks)}</p>'
            self._onward.objects = [look.words(text)]
        elif not self._onward.objects or not isinstance(self._onward[0], pn.widgets.Button):
            ways = [(following, f"Next: {following.title}")]
            if following.optional:
                beyond = STEPS[place + 2]
                ways.append((beyond, f"Next: {beyond.title}, without {following.title}"))
            self._onward.objects = [self._way(step.key, words) for step, words in ways]

    def _way(self, key: str, words: str) -> pn.widgets.Button:
        """Returns a button that leads to a step."""
        button = pn.widgets.Button(
            name=words, button_type="primary", stylesheets=[look.CONTROLS], margin=(0, 8, 0, 0)
        )
        button.on_click(self.told(lambda event: self.show(key)))
        button.js_on_click(code=_noted(key))
        return button

    def _show_equivalent(self) -> None:
        command = look.plain(shown_commands(self.session, self.key))
        code = look.plain(python(self.session, self.key))
        html = (
            "<details><summary>The command and the Python that do the same</summary>"
            f"<pre>{command}</pre><pre>{code}</pre></details>"
        )
        if self._equivalent.object != html:
            self._equivalent.object = html


def _noted(key: str) -> str:
    """Returns the script that notes a step in the address, so that a reload leads back to it."""
    return f"ehsidNote({{step: '{key}'}})"


def _argument(name: str) -> str:
    """Returns an argument of the address of the page; "" without it."""
    values = (pn.state.session_args or {}).get(name)
    return values[0].decode(errors="replace") if values else ""
