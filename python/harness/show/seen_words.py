# SPDX-License-Identifier: MIT
"""How small a cause could still be seen, as a table and in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from ..catalogue.parameters import effects, plain_name, plant_parameters, size_name
from ..catalogue.spellings import ParameterKey
from ..diagnosis.schema import CouldBeSeen
from .gap_words import named_effect, quantity, unit_of
from .page import Block, Folded, Table
from .units import percent

# Effects that are asked for first, and how many of them a sentence has.
ASKED_FIRST = ("internal_leakage", "coulomb_friction", "valve_dead_band", "transport_delay")
IN_SENTENCE = 3
DIGITS = 2


def seen_size(name: str, size: float) -> str:
    """Returns a size, SI, of a parameter given by its full name, in the unit that is shown."""
    exact = plant_parameters()[name].neutral  # a gain of 1.02 is one that is wrong by 2 %
    change = float(f"{size - exact:.{DIGITS}g}")
    return quantity(exact + change, unit_of(name), DIGITS)


def _power(one: CouldBeSeen) -> float:
    """Power by which the outputs depend on the size that is told: below zero, less shows more."""
    return {p.name: p.power for p in effects()[one.id].parameters}[one.parameter]


def seen_sentence(seen: Sequence[CouldBeSeen], *, shown: bool = False) -> str:
    """Returns the sizes below which the first effects are not seen; "" without any.

    shown: from which on they are seen.
    """
    below, above = ("from", "up to") if shown else ("below", "above")
    order = {effect: place for place, effect in enumerate(ASKED_FIRST)}
    told = sorted(
        (one for one in seen if one.id in order and one.limit != "none"),
        key=lambda one: order[one.id],
    )
    parts = [
        f"{plain_name(one.id)} {below if _power(one) > 0.0 else above} "
        f"{seen_size(ParameterKey.of_effect(one.id, one.parameter), one.size)}"
        for one in told[:IN_SENTENCE]
    ]
    return ", ".join(parts)


def seen_from(one: CouldBeSeen) -> str:
    """Returns the size from which on an effect shows, such as "from 2 ms", or "at no size"."""
    if one.limit == "none":
        return "at no size"
    way = "from" if _power(one) > 0.0 else "down from"
    return f"{way} {seen_size(ParameterKey.of_effect(one.id, one.parameter), one.size)}"


def seen_table(seen: Sequence[CouldBeSeen]) -> Table:
    """Returns for each effect the size from which on it shows, and what is to be known of it."""
    rows = []
    for one in seen:
        names = {name: ParameterKey.of_effect(one.id, name) for name in one.sizes}
        beside = [
            f"{size_name(key)} {seen_size(key, one.sizes[name])}"
            for name, key in names.items()
            if name != one.parameter and one.sizes[name] != 0.0
        ]
        notes = [f"with {', '.join(beside)}"] if beside else []
        if one.limit == "least_size":
            notes.append("every sound servo has what is smaller")
        rows.append((named_effect(one.id), seen_from(one), "; ".join(notes)))
    return Table("", ("effect", "would have been seen", "note"), rows)


def seen_blocks(seen: Sequence[CouldBeSeen]) -> list[Block]:
    """Returns what a page says of it, the table folded; nothing where nothing is known."""
    if not seen:
        return []
    sentence = seen_sentence(seen)
    text = (
        "An effect that is not named may still be there, as long as it is small. The table has the "
        f"size from which on these records would have shown it, with a power of {percent(0.9)} and "
        "with what the simulator leaves unexplained in them."
    )
    first = [f"Would not have been seen: {sentence}."] if sentence else []
    return [
        *first,
        Folded(f"How small a cause could be ({len(seen)} effects)", [text, seen_table(seen)]),
    ]
