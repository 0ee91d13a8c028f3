# SPDX-License-Identifier: MIT
"""How the workbench looks: one style sheet for all parts, light and dark, and the page around.

Parts of the page in columns of equal width, as many as there is room for.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import LayoutDOM
from bokeh.plotting import figure

from ehsid.harness.base.error_words import printable
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.show.gap_words import quantity
from ehsid.harness.show.page import Block
from ehsid.harness.show.plotting import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from ehsid.harness.show.rendering import html

# Colours of lines; blue and vermilion are too dark on a dark ground.
COLOURS = {
    "light": (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY),
    "dark": (SKY, ORANGE, GREEN, PURPLE, VERMILION, BLUE),
}
THEMES = {
    "light": {
        "ground": "#f3f5f7", "paper": "#ffffff", "ink": "#1c2126", "soft": "#57606a",
        "line": "#d0d7de", "accent": BLUE, "on": "#ffffff", "good": "#0b6b4d", "bad": "#a63d00",
        "tint": "#e8f1f8",
    },
    "dark": {
        "ground": "#12161a", "paper": "#1b2026", "ink": "#e6eaee", "soft": "#a3adb8",
        "line": "#38424c", "accent": SKY, "on": "#0d1216", "good": "#4fc79b", "bad": "#ff9a5c",
        "tint": "#1f2f3b",
    },
}  # fmt: skip

SHEET = ":host { --above: 15.1rem; }"  # what is above a pane of a sheet
PULSE = "ehsid-pulse"  # tag of the field by which a page sees that the server has answered
CODE = re.compile("`([a-z0-9. -]+)`")

STYLE = Path(__file__).parent / "style"
WORDS, CONTROLS, STEPS, STEP_BUTTON, PANES, PANE = (
    (STYLE / f"{name}.css").read_text(encoding="utf-8")
    for name in ("words", "controls", "steps", "step_button", "panes", "pane")
)


# Pages of their own, by their address: each is reached from the head of all others.
VIEWS = {"": "Workbench", "machines": "Machines", "playground": "Playground", "live": "Live"}


def template(name: str, theme: str) -> pn.Template:
    """Returns the page around the parts, `page` or `view`, with the colours of both themes."""
    rules = "\n  ".join(
        f"{':root, ' if key == 'light' else ''}[data-theme={key}] {{ color-scheme: {key}; "
        + " ".join(f"--{colour}: {value};" for colour, value in colours.items())
        + " }"
        for key, colours in THEMES.items()
    )
    parts = [(STYLE / f"{part}.html").read_text(encoding="utf-8") for part in ("head", name)]
    text = "".join(parts).replace("THEME_RULES", rules)
    for place, script in (
        ("THEME_SCRIPT", "theme"),
        ("BUSY_SCRIPT", "busy"),
        ("VIEW_SCRIPT", "sort"),
    ):
        text = text.replace(place, (STYLE / f"{script}.js").read_text(encoding="utf-8"))
    made = pn.Template(text.replace("PULSE", PULSE))
    made.add_panel("pulse", _pulse())
    made.add_variable("theme", theme)
    made.add_variable("other_words", f"{'light' if theme == 'dark' else 'dark'} colours")
    made.add_variable("views", VIEWS)
    return made


def _pulse() -> pn.widgets.TextInput:
    """Returns a hidden field; each of its values is answered in its tags, behind earlier clicks."""
    made = pn.widgets.TextInput(visible=False, tags=[PULSE])

    def answer(event: Any) -> None:
        made.tags = [PULSE, event.new]

    made.param.watch(answer, "value")
    return made


def words(text: str) -> pn.pane.HTML:
    """Returns a part of the page made of HTML; what others wrote in it is escaped with `plain`."""
    return pn.pane.HTML(text, stylesheets=[WORDS], sizing_mode="stretch_width", margin=(4, 0))


def button(name: str, *, primary: bool = False) -> pn.widgets.Button:
    """Returns a button in the look of the page."""
    kind = "primary" if primary else "default"
    return pn.widgets.Button(
        name=name, button_type=kind, stylesheets=[CONTROLS], margin=(4, 8, 4, 0)
    )


def select(name: str, **settings: Any) -> pn.widgets.Select:
    """Returns a field with a list to choose from, in the look of the page."""
    settings = {"stylesheets": [CONTROLS], "margin": (4, 8, 4, 0), **settings}
    return pn.widgets.Select(name=name, **settings)


def text_input(name: str, **settings: Any) -> pn.widgets.TextInput:
    """Returns a field to write into, in the look of the page."""
    settings = {"stylesheets": [CONTROLS], "margin": (4, 8, 4, 0), **settings}
    return pn.widgets.TextInput(name=name, **settings)


def size_slider(
    name: str,
    unit: str,
    stops: FloatArray,
    size: float,
    moved: Callable[[float], None],
    *,
    when: str = "value",
) -> pn.Column:
    """Returns a slider over sizes, which stand above it with their unit.

    Parameters
    ----------
    name
        what is moved.
    unit
        of the sizes, SI.
    stops, size
        where it can stand, in order, and where it begins.
    moved
        called with each new size, or where it is let go with `when` "value_throttled".
    """
    low, high = (quantity(end, unit, 3) if end else "0" for end in (stops[0], stops[-1]))

    def title(now: float) -> str:
        told = f'{name}: <b>{quantity(now, unit, 3)}</b> <span class="soft">({low} to {high})'
        return f'<p class="small">{told}</span></p>'

    shown = words(title(size))
    # It moves over the numbers of the stops, which say nothing: the size stands above it.
    slider = pn.widgets.IntSlider(
        start=0,
        end=len(stops) - 1,
        value=int(np.argmin(np.abs(stops - size))),
        show_value=False,
        stylesheets=[CONTROLS],
        sizing_mode="stretch_width",
        margin=(0, 12, 8, 8),
    )

    def told(event: Any) -> None:
        shown.object = title(float(stops[event.new]))

    slider.param.watch(told, "value")
    slider.param.watch(lambda event: moved(float(stops[event.new])), when)
    return pn.Column(shown, slider, sizing_mode="stretch_width", margin=0)


def drawn(plot: LayoutDOM) -> pn.pane.Bokeh:
    """Returns a plot as a part of the page, as wide as its place."""
    return pn.pane.Bokeh(plot, sizing_mode="stretch_width", margin=0)


def beside(*parts: pn.viewable.Viewable, least: str = "16rem") -> pn.FlexBox:
    """Returns parts side by side, which share the width, and one below the other where it ends."""
    for part in parts:
        part.sizing_mode = None
        part.styles = {"flex": f"1 1 {least}", "min-width": f"min({least}, 100%)"}
    return pn.FlexBox(*parts, sizing_mode="stretch_width", gap="0 1.2rem", align_items="start")


def tick(text: str, value: bool) -> pn.widgets.CheckBoxGroup:
    """Returns a box to be ticked; its value is a list, empty where it is not ticked.

    The text is a part of the box, for who clicks on it and who hears it read, as Panel's Checkbox
    does not have it.
    """
    return pn.widgets.CheckBoxGroup(
        options={text: True}, value=[True] * value, stylesheets=[CONTROLS], margin=(4, 0)
    )


def side_by_side(*parts: pn.viewable.Viewable, least: str = "22rem") -> pn.Column:
    """Returns parts in columns of one width, as `beside`; plots need this one to know theirs."""
    # At most two columns: a third one of 40 % has no room.
    columns = f"repeat(auto-fit, minmax(min(max({least}, 40%), 100%), 1fr))"
    grid = f"display: grid !important; grid-template-columns: {columns}; gap: 0 1.2rem;"
    rules = f":host {{ {grid} }}"
    return pn.Column(*parts, stylesheets=[rules], sizing_mode="stretch_width")


def panes(
    left: Sequence[pn.viewable.Viewable],
    right: Sequence[pn.viewable.Viewable],
    shares: tuple[int, int] = (1, 1),
) -> pn.Column:
    """Returns two panes with shares of the width, which fit a wide window together.

    What is too long for its pane is scrolled there, so that the other one stays in sight. In a
    narrow window they are one below the other, as long as they are.
    """
    held = [
        pn.Column(*parts, stylesheets=[PANE], sizing_mode="stretch_width")
        for parts in (left, right)
    ]
    rules = PANES.replace("SHARES", " ".join(f"minmax(0, {share}fr)" for share in shares))
    return pn.Column(*held, stylesheets=[rules], sizing_mode="stretch_width")


class Switch:
    """A row of buttons, of which one is chosen: which of the sheets that fit one window is shown.

    Attributes
    ----------
    layout
        the row.
    chosen
        the name on the button that was pressed last; the first one until then, "" without any.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self.layout = pn.FlexBox(sizing_mode="stretch_width")
        self.chosen = ""
        self._changed = changed
        self._buttons: dict[str, pn.widgets.Button] = {}

    def offer(self, names: Sequence[str]) -> None:
        """Offers these names; the chosen one stays where it is among them."""
        if list(self._buttons) != list(names):
            self._buttons = {name: button(name) for name in names}
            for name, one in self._buttons.items():
                one.on_click(lambda event, name=name: self.choose(name))
            self.layout.objects = list(self._buttons.values())
        self.choose(self.chosen if self.chosen in names else next(iter(names), ""))

    def choose(self, name: str) -> None:
        """Chooses a name, as a press on its button does."""
        self.chosen = name
        for key, one in self._buttons.items():
            one.css_classes = ["sheet", "chosen"] if key == name else ["sheet"]
        self._changed()


class Sheets:
    """Parts of which one is shown, below the switch that chooses it; `layout` has all."""

    def __init__(self, parts: Mapping[str, Sequence[pn.viewable.Viewable]]) -> None:
        self._held: dict[str, pn.Column] = {}
        self._switch = Switch(self._turn)
        self.layout = pn.Column(sizing_mode="stretch_width")
        self.show(parts)

    def show(self, parts: Mapping[str, Sequence[pn.viewable.Viewable]]) -> None:
        """Shows other parts; the name that is chosen stays where it is among them."""
        self._held = {
            name: pn.Column(*part, stylesheets=[SHEET], sizing_mode="stretch_width")
            for name, part in parts.items()
        }
        self._switch.offer(list(parts))
        self.layout.objects = [self._switch.layout, *self._held.values()] if parts else []

    def _turn(self) -> None:
        for name, one in self._held.items():
            one.visible = name == self._switch.chosen


def title(name: str, purpose: str) -> pn.pane.HTML:
    """Returns the title of a step, with what it is for beside it."""
    return words(f'<div class="title"><h1>{name}</h1><p class="soft">{purpose}</p></div>')


def plain(text: object) -> str:
    """Returns a text of others as HTML that says exactly this text."""
    return escape(printable(str(text)))


def told(*blocks: Block) -> str:
    """Returns blocks as HTML; headings are those of a part of the page, and `words` are code."""
    return CODE.sub(r"<code>\1</code>", html(blocks, heading=2))


def files(address: str, words: Mapping[str, str], query: str = "?download=1") -> str:
    """Returns a list of links to files below an address; a page opens, and others are saved."""
    items = "".join(
        f'<li><a href="{address}/{plain(name)}{"" if name.endswith(".html") else query}" '
        f'target="_blank">{plain(name)}</a>: {plain(about)}</li>'
        for name, about in words.items()
    )
    return f"<ul>{items}</ul>"


def error(text: str) -> str:
    """Returns a problem as HTML."""
    return f'<div class="error" role="alert">{plain(text)}</div>' if text else ""


def dress(plot: figure, theme: str) -> None:
    """Gives a plot the colours of the theme."""
    colours = THEMES[theme]
    plot.background_fill_color = plot.border_fill_color = colours["paper"]
    plot.outline_line_color = colours["line"]
    for axis in plot.axis:
        axis.axis_label_text_color = axis.major_label_text_color = colours["ink"]
        axis.axis_label_text_font_style = "normal"
        axis.axis_line_color = axis.major_tick_line_color = colours["soft"]
        axis.minor_tick_line_color = None
    for grid in plot.grid:
        grid.grid_line_color = colours["line"]
        grid.grid_line_alpha = 0.6
    for legend in plot.legend:
        legend.background_fill_color = colours["paper"]
        legend.background_fill_alpha = 0.8
        legend.label_text_color = colours["ink"]
        legend.border_line_color = colours["line"]


def in_columns(*parts: pn.viewable.Viewable, least: str = "14rem") -> pn.Column:
    """Returns the parts in rows of columns that are at least this wide, and of equal width."""
    for part in parts:
        part.sizing_mode = "stretch_width"
    columns = f"repeat(auto-fill, minmax(min({least}, 100%), 1fr))"
    return pn.Column(
        *parts,
        sizing_mode="stretch_width",
        styles={"display": "grid", "grid-template-columns": columns, "gap": "0 1.2rem"},
    )
