# SPDX-License-Identifier: MIT
"""One page in one browser tab: the steps beside the step that is open.

A page of its own beside the workbench, which belongs to no session.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec

import panel as pn

from ehsid.harness.base.error_words import error_words

from . import look
from .equivalent import python, shown_commands
from .flow import STEPS, StepState, next_step, step_states
from .session import Session
from .steps.check import CheckStep
from .steps.gap import GapStep
from .steps.load import LoadStep
from .steps.map import MapStep
from .steps.next import NextStep
from .steps.recursive import ModelStep
from .steps.rig import RigStep
from .steps.step import StepView
from .workbench import ERRORS, Workbench

VIEWS: dict[str, type[StepView]] = {
    "load": LoadStep,
    "map": MapStep,
    "rig": RigStep,
    "check": CheckStep,
    "model": ModelStep,
    "gap": GapStep,
    "next": NextStep,
}
NEW = "+ new machine"
# Notes the step of a button in the address, so that a reload leads back to it.
NOTE = "ehsidNote({step: source.tags[0]})"
FOLD = "The command and the Python that do the same"

# Buttons to steps whose title says too little there.
ONWARD = {"next": "Next: use what was found"}

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
        self.theme = "dark" if argument("theme") == "dark" else "light"
        self.session = self._asked_for()
        self._steps = pn.Column(stylesheets=[look.STEPS], sizing_mode="stretch_width")
        self._step = pn.Column(sizing_mode="stretch_width")
        self._buttons = self._make_buttons()
        self._problem = look.words("")
        self._equivalent = look.words("")
        self._fold = self._make_fold()
        self._ways, self._not_yet = [self._make_way() for _ in range(2)], look.words("")
        self._onward = pn.FlexBox(*self._ways, self._not_yet)
        asked = argument("step")
        found = step_states(self.session)
        self.key = asked if asked in found and found[asked].open else next_step(self.session)
        self._view: StepView | None = None
        self._waiting = False
        self.template = self._make_template()
        document = pn.state.curdoc
        stop = self.session.listen(lambda: self._later(document))
        pn.state.on_session_destroyed(lambda context: stop())
        self.show(self.key)

    def _asked_for(self) -> Session:
        name = argument("session")
        if name == NEW:
            return self.workbench.begun("")
        known = name in self.workbench.names()
        return self.workbench.opened(name) if known else self.workbench.latest()

    def _make_template(self) -> pn.Template:
        template = look.template("page", self.theme)
        template.add_variable("session_name", self.session.name)
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
                tags=[step.key],
                stylesheets=[look.CONTROLS, look.STEP_BUTTON],
            )
            button.on_click(self.told(lambda event, key=step.key: self.show(key)))
            button.js_on_click(code=NOTE)
            buttons[step.key] = button
        self._steps.objects = list(buttons.values())
        return buttons

    def _make_fold(self) -> pn.widgets.Toggle:
        fold = pn.widgets.Toggle(name=FOLD, stylesheets=[look.CONTROLS], margin=(4, 0))

        def turned(event: Any) -> None:
            self._equivalent.visible = event.new

        fold.param.watch(turned, "value")
        self._equivalent.visible = False
        return fold

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

    def say(self, text: str) -> None:
        """Shows above the step what was done."""
        self._problem.object = f'<p class="verdict" role="status">{look.plain(text)}</p>'

    def show(self, key: str) -> None:
        """Opens a step; one that is open stays as it is, so that no click on it is lost."""
        if self._view is not None and key == self.key:
            return
        self.key = key
        step = next(one for one in STEPS if one.key == key)
        title = look.title(step.title, step.purpose)
        head = look.beside(title, self._onward)
        self._onward.styles = {"flex": "0 1 auto"}
        parts = [head, self._problem, self._fold, self._equivalent]
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
            found = step_states(self.session)
            for number, step in enumerate(STEPS, start=1):
                button, state = self._buttons[step.key], found[step.key]
                mark = " ✓" if state.done else ""
                button.name = f"{number}  {step.title}{mark}"
                button.disabled = not state.open
                button.button_type = "primary" if step.key == self.key else "default"
            if self._view is not None:
                self._view.refresh()
            self._show_onward(found)
            self._show_equivalent()
        except Exception as error:
            self.tell(error)

    def _show_onward(self, found: dict[str, StepState]) -> None:
        following = STEPS[[step.key for step in STEPS].index(self.key) + 1 :]
        ways = []
        self._not_yet.object = ""
        if following and found[following[0].key].open:
            step = following[0]
            ways.append((step, ONWARD.get(step.key, f"Next: {step.title}")))
            if following[0].optional:
                without = f"Next: {following[1].title}, without {following[0].title}"
                ways.append((following[1], without))
        elif following:
            lacks = f"{following[0].title} opens when this step holds: {found[self.key].why}"
            self._not_yet.object = f'<p class="soft">{look.plain(lacks)}</p>'
        for button, (step, words) in zip(self._ways, ways, strict=False):
            button.param.update(name=words, tags=[step.key])
        for number, button in enumerate(self._ways):
            button.visible = number < len(ways)

    def _make_way(self) -> pn.widgets.Button:
        """Returns a button that leads to the step in its tags."""
        button = pn.widgets.Button(
            button_type="primary", stylesheets=[look.CONTROLS], margin=(0, 8, 0, 0)
        )
        button.on_click(self.told(lambda event: self.show(button.tags[0])))
        button.js_on_click(code=NOTE)
        return button

    def _show_equivalent(self) -> None:
        command = look.plain(shown_commands(self.session, self.key))
        code = look.plain(python(self.session, self.key))
        html = f"<pre>{command}</pre><pre>{code}</pre>"
        if self._equivalent.object != html:
            self._equivalent.object = html


def argument(name: str) -> str:
    """Returns an argument of the address of the page; "" without it."""
    values = (pn.state.session_args or {}).get(name)
    return values[0].decode(errors="replace") if values else ""


class View:
    """A page in a browser tab; `layout` is what it shows below its title."""

    key = ""
    title = ""
    purpose = ""
    button = staticmethod(look.button)

    def __init__(self, workbench: Workbench) -> None:
        self.workbench = workbench
        self.theme = "dark" if argument("theme") == "dark" else "light"
        self.problem = look.words("")
        self.layout = pn.Column(sizing_mode="stretch_width")
        title = look.words(f'<h1>{self.title}</h1><p class="soft">{self.purpose}</p>')
        self.template = look.template("view", self.theme)
        self.template.add_variable("view", self.key)
        whole = pn.Column(title, self.problem, self.layout, sizing_mode="stretch_width")
        self.template.add_panel("view", whole)
        self.template.title = f"{self.title} - ehsid"

    def told(self, handler: Callable[P, None], *, keep: bool = False) -> Callable[P, None]:
        """Returns a handler whose errors are told on the page; it never shows a traceback.

        `keep` leaves the earlier message as it is, for what runs without a click.
        """

        @wraps(handler)
        def safely(*args: P.args, **kwargs: P.kwargs) -> None:
            try:
                if not keep:
                    self.problem.object = ""
                handler(*args, **kwargs)
            except Exception as error:
                self.problem.object = look.error(self.words_of(error))

        return safely

    def words_of(self, error: Exception) -> str:
        """Returns an error in words; a fault of the program is written down."""
        text = error_words(error)
        if text is not None:
            return text
        log = self.workbench.folder / ERRORS
        with log.open("a", encoding="utf-8") as file:
            file.write(traceback.format_exc())
        return (
            f"A fault of the program ({type(error).__name__}), which is not due to your data. "
            f"{log} has what its authors need to mend it."
        )

    def say(self, html: str) -> None:
        """Shows below the title what was done."""
        self.problem.object = f'<p class="verdict" role="status">{html}</p>'
