# SPDX-License-Identifier: MIT
"""A page of its own beside the workbench, which belongs to no session."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

import panel as pn

from ehsid.harness.base.error_words import error_words

from . import look
from .page import argument
from .workbench import ERRORS, Workbench

P = ParamSpec("P")


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
