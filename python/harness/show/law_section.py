# SPDX-License-Identifier: MIT
"""Shows the laws that the catalogue does not have: each as a curve with its band."""

from __future__ import annotations

from bokeh.models import Legend
from bokeh.plotting import figure

from ..diagnosis.schema import MissingLaw
from ..rigs.table_words import OF_TERM, OF_VARIABLE, TERM_WORDS, VARIABLE_WORDS, table_words
from .gap_plots import quiet_axes
from .gap_words import first_upper
from .page import Block, Card, Note, Plot, Section
from .plotting import BLUE, VERMILION
from .shares import percent

Form = tuple[float, ...] | None  # values of a simple form at the knots of a law


def missing_law_section(laws: tuple[MissingLaw, ...], forms: tuple[Form, ...]) -> Section:
    """Returns the section; it is empty where there is no law.

    laws, forms: as `missing_laws` and `law_forms` of the diagnosis.
    """
    if not laws:
        return Section("The missing law", [])
    text = (
        "Each curve is a term that was added to an equation of the simulator and fitted like an "
        "effect, together with all values of the rig. The band is meant to hold 90 %: on generated "
        "machines with a withheld law it held the true curve in 20 of 25. Beyond its ends the "
        "records never went, and nothing is known. The file rig.augmented.toml has the curve as a "
        "table, and ehsid simulate runs it."
    )
    title = "The missing law" if len(laws) == 1 else "The missing laws"
    return Section(title, [text, *map(_card, laws, forms)])


def _card(found: MissingLaw, form: Form) -> Card:
    law = found.law
    words = first_upper(table_words(law.adds_to, law.of))
    blocks: list[Block] = [
        Note(
            f"It {found.looks_like}. It has {percent(found.share_of_shrinkage)} of the shrinkage "
            "of the gap on held-out data."
        ),
        Plot(_figure(found, form)),
    ]
    if found.rivals:
        others = ", or ".join(table_words(adds_to, of) for adds_to, of in found.rivals)
        blocks.append(Note(f"These records hardly tell it from {others}. {_measure_next(found)}"))
    return Card(words, blocks)


# What separates laws over two variables, where one of them is the key.
APART = {
    "time_s": "Record the same motion a second time: what depends on the time does not repeat.",
    "position_m": "Record the same motion about another place of the stroke.",
    "velocity_m_s": "Record the same path at half the speed.",
    "spool": "Record the same motion with another load, so that the valve opens by another amount.",
}


def _measure_next(found: MissingLaw) -> str:
    """Returns the motion that tells the law from its rivals."""
    variables = [found.law.of, *(of for _, of in found.rivals)]
    if len(set(variables)) == 1:
        return "Record the pressures, too: they tell which equation lacks the term."
    return next(
        (words for variable, words in APART.items() if variable in variables),
        "Record the same motion at another supply pressure.",
    )


def _figure(found: MissingLaw, form: Form) -> figure:
    law = found.law
    (unit, scale), (x_unit, x_scale) = OF_TERM[law.adds_to], OF_VARIABLE[law.of]
    x = [x_scale * knot for knot in law.knots]
    made = figure(
        height=260,
        sizing_mode="stretch_width",
        x_axis_label=f"{VARIABLE_WORDS[law.of]} in {x_unit}",
        y_axis_label=f"{TERM_WORDS[law.adds_to]} in {unit}",
        toolbar_location=None,
        outline_line_color="#d5dae0",
        min_border_left=64,
    )
    low, high = ([scale * ends[side] for ends in found.band] for side in (0, 1))
    band = made.varea(x, low, high, color=BLUE, alpha=0.2)
    line = made.line(x, [scale * value for value in law.values], color=BLUE, line_width=2.0)
    made.scatter(x, [scale * value for value in law.values], color=BLUE, size=5)
    shown = [("curve that explains the gap", [line]), ("90 %", [band])]
    if form is not None:
        simple = made.line(
            x, [scale * value for value in form], color=VERMILION, line_dash="dashed"
        )
        shown.append(("simple form", [simple]))
    made.add_layout(
        Legend(
            items=shown,
            orientation="horizontal",
            ncols=2,  # more of them would be cut off on the screen of a telephone
            border_line_color=None,
            label_text_font_size="11px",
            padding=2,
            margin=0,
        ),
        "above",
    )
    quiet_axes(made)
    return made
