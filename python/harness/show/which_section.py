# SPDX-License-Identifier: MIT
"""The sections of a diagnosis on which effect it is, and on laws beyond the catalogue.

What to do after a diagnosis, in words: by its verdict, and for the next experiment.
"""

from __future__ import annotations

import itertools
import shlex
from collections.abc import Sequence

from bokeh.plotting import figure

from ..catalogue.channels import shown_channel
from ..catalogue.parameters import effects, plain_name, value_name
from ..catalogue.spellings import ParameterKey
from ..diagnosis.result import Diagnosis, Wandering
from ..diagnosis.schema import Candidate, Effect, MissingLaw
from ..rigs.rig import OF_TERM, OF_VARIABLE, TERM_WORDS, VARIABLE_WORDS, table_words
from .gap_plots import legend_above, share_bar, term_figure
from .gap_words import (
    STANDINGS,
    candidate_notes,
    chosen,
    effect_set,
    first_upper,
    interval,
    named_effect,
    named_effects,
    nats_behind,
    quantity,
    unit_of,
)
from .page import Block, Card, Code, Folded, Heading, Items, Note, Plot, Section, Table, Tagged
from .plotting import FITTED, FOUND, GREY, SECOND, THIRD
from .units import percent

# Number of candidates that the page shows unfolded.
SHOWN_CANDIDATES = 8


def which_section(diagnosis: Diagnosis) -> Section:
    """Returns the section; it has no blocks where no effect was looked for."""
    blocks: list[Block] = []
    several = len(diagnosis.ambiguity_set) > 1
    if several:
        sets = [named_effects(names) for names in diagnosis.ambiguity_set]
        blocks += [
            "The data cannot tell these apart, best first:",
            Items(sets, numbered=True),
        ]
    blocks += [
        _card(effect, several=several, shared=len(diagnosis.effects) > 1)
        for effect in diagnosis.effects
    ]
    if diagnosis.candidates:
        rest = len(diagnosis.candidates) - SHOWN_CANDIDATES
        blocks += [
            Heading("All that was tried, ranked on held-out data"),
            _candidates(diagnosis.candidates, 0, SHOWN_CANDIDATES),
        ]
        if rest > 0:
            table = _candidates(diagnosis.candidates, SHOWN_CANDIDATES, None)
            blocks.append(Folded(f"{rest} more", [table]))
        blocks.append(
            Note(
                "Every set was fitted together with all values of the rig. All short fits had the "
                "same budget, and so had all long ones. "
                f"{candidate_notes(diagnosis.candidates)} "
                '"Gap removed" is the share of the gap above the noise floor that remained after '
                "the rig's values were fitted. Marked sets are those the data cannot tell from the "
                "best."
            )
        )
    if diagnosis.outside_probability is not None:
        blocks.append(
            Note(
                "Probability of a cause outside of the catalogue: "
                f"{percent(diagnosis.outside_probability)}."
            )
        )
    return Section("Which effect", blocks)


def _card(effect: Effect, *, several: bool, shared: bool) -> Card:
    info = effects()[effect.id]
    meanings = {parameter.name: parameter.meaning for parameter in info.parameters}
    notes = [
        *(["most probable of the set"] if several else []),
        info.subsystem,
        f"probability {percent(effect.probability)}",
        *([f"{percent(effect.share_of_shrinkage)} of what is removed"] if shared else []),
    ]
    sizes = Table(
        "",
        ("size", "estimate", "90 % interval"),
        [
            (
                Tagged(meanings.get(name, plain_name(name)), hint=name),
                *interval(estimate, unit_of(ParameterKey.of_effect(effect.id, name))),
            )
            for name, estimate in effect.parameters.items()
        ],
    )
    source = [Note(info.source)] if info.source else []
    equation = Folded("Equation", [Code(info.equation), *source])
    return Card(named_effect(effect.id), [Note(" · ".join(notes)), sizes, equation])


def _candidates(candidates: Sequence[Candidate], first: int, end: int | None) -> Table:
    best = chosen(candidates)
    rows = [
        (
            named_effects(
                candidate.effects,
                f"{rank}. ",
                STANDINGS[candidate.standing] if candidate.in_confidence_set else "",
            ),
            nats_behind(candidate, best),
            share_bar("", candidate.held_out_shrinkage),
            "" if candidate.probability is None else percent(candidate.probability),
            ", ".join(
                f"{value_name(f'effects.{name}')} "
                f"{quantity(value, unit_of(f'effects.{name}'), 3)}".partition(": ")[2]
                for name, value in candidate.parameters.items()
            ),
            _decision(candidate),
        )
        for rank, candidate in enumerate(candidates[first:end], start=first + 1)
    ]
    marked = [i for i, candidate in enumerate(candidates[first:end]) if candidate.in_confidence_set]
    columns = ("effects", "nats behind", "gap removed", "probability", "sizes", "decision")
    return Table("", columns, rows, marked)


def _decision(candidate: Candidate) -> str:
    return ": ".join(filter(None, (STANDINGS[candidate.standing], candidate.why)))


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
    return Section(title, [text, *map(_law_card, laws, forms)])


def _law_card(found: MissingLaw, form: Form) -> Card:
    law = found.law
    words = first_upper(table_words(law.adds_to, law.of))
    blocks: list[Block] = [
        Note(
            f"It {found.looks_like}. It has {percent(found.share_of_shrinkage)} of the shrinkage "
            "of the gap on held-out data."
        ),
        Plot(_law_figure(found, form)),
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


def wandering_section(found: Wandering | None) -> Section:
    """Returns the section on a term that follows the time alone; it is empty where none does."""
    if found is None:
        return Section("What wanders", [])
    text = (
        "In every record, what the simulator lacks in half a second can be told from the half "
        "seconds before and after it, whatever the rod does there."
    )
    if found.adds_to == "sensor":
        text += " A steady rate is left out: a null bias of the valve would look the same."
    unit, scale = OF_TERM[found.adds_to]
    made = term_figure("time in s", f"{TERM_WORDS[found.adds_to]} in {unit}")
    shown = [
        (name, [made.line(time_s, scale * value, color=colour, line_width=2.0)])
        for (name, (time_s, value)), colour in zip(
            found.curves.items(), itertools.cycle((FITTED, SECOND, THIRD)), strict=False
        )
    ]
    legend_above(made, shown)
    return Section("What wanders", [text, Plot(made)])


def _law_figure(found: MissingLaw, form: Form) -> figure:
    law = found.law
    (unit, scale), (x_unit, x_scale) = OF_TERM[law.adds_to], OF_VARIABLE[law.of]
    x = [x_scale * knot for knot in law.knots]
    made = term_figure(
        f"{VARIABLE_WORDS[law.of]} in {x_unit}", f"{TERM_WORDS[law.adds_to]} in {unit}"
    )
    found_colour = FOUND
    low, high = ([scale * ends[side] for ends in found.band] for side in (0, 1))
    band = made.varea(x, low, high, color=found_colour, alpha=0.2)
    line = made.line(x, [scale * value for value in law.values], color=found_colour, line_width=2.0)
    made.scatter(x, [scale * value for value in law.values], color=found_colour, size=5)
    shown = [("curve that explains the gap", [line]), ("90 %", [band])]
    if form is not None:
        simple = made.line(x, [scale * value for value in form], color=GREY, line_dash="dashed")
        shown.append(("simple form", [simple]))
    legend_above(made, shown)
    return made


def experiment_words(description: str, separates: Sequence[str], power: float | None) -> str:
    """Returns in two sentences what an experiment is, and what it separates how surely.

    Parameters
    ----------
    description, separates, power
        as in `gap.schema.NextExperiment`.
    """
    rivals = " from ".join(effect_set(tuple(names.split("+"))) for names in separates)
    return (
        f"{first_upper(description)}. It is made to separate {rivals}, and will do so with a "
        f"predicted probability of {percent(power)}."
    )


def experiment_steps(sensors: Sequence[str]) -> list[str]:
    """Returns how to run an experiment safely, and which columns to log; one step an item."""
    return [
        "Put the rod where the predicted position begins, and send the column command_v of "
        "next_experiment.csv to the valve amplifier as it stands, sample by sample. It keeps "
        "inside the stroke and the limits that the rig file states; keep the emergency stop at "
        "hand all the same.",
        f"Log {', '.join(shown_channel(name)[0] for name in sensors)} with the command, as in the "
        "records so far.",
    ]


def again_command(fitted: Sequence[str], judged: Sequence[str], rig_file: str) -> str:
    """Returns the command that diagnoses again with the record of the experiment, new.csv."""
    held_out = [part for file in judged for part in ("--validate", file)]
    words = ["ehsid", "gap", *fitted, "new.csv", "--rig", rig_file, *held_out, "--out", "again"]
    return shlex.join(words)
