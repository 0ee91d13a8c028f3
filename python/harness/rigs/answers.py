# SPDX-License-Identifier: MIT
"""Makes a rig file of answers in the units of engineers; typical values fill the rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from .commented import commented_text
from .new import Entry, axis_entries, ehs_entries
from .quantities import Quantity, read_quantity
from .questions import EXAMPLES, QUESTIONS
from .reading import parse_rig

# Answers of which one alone says nothing.
PAIRS = (("line-length", "line-bore"), ("accumulator-volume", "accumulator-precharge"))


def of_one_edge(drop: Quantity) -> Quantity:
    """Returns the drop over one metering edge for one that was measured over both."""
    return replace(drop, value=0.5 * drop.value, text=f"half of {drop.text} over both edges")


def check_pairs(known: Mapping[str, Quantity]) -> None:
    """Checks that of each pair of answers both are there, or none.

    Raises
    ------
    ValueError
        one of a pair is missing.
    """
    for pair in PAIRS:
        if len(known.keys() & pair) == 1:
            raise ValueError(
                f"--{pair[0]}, --{pair[1]}: expected both or neither; give the other one, too"
            )


def read_answer(plant: str, name: str, text: str) -> Quantity:
    """Returns what an answer such as "63 mm" says.

    Parameters
    ----------
    plant, name
        keys of `QUESTIONS`: the kind of plant, and the name of the question.
    text
        the answer; without a unit the usual one is taken.

    Raises
    ------
    ValueError
        the answer cannot be read; the message begins with the words of the question.
    """
    question = next(one for one in QUESTIONS[plant] if one.name == name)
    return read_quantity(text, question.words, question.usual, question.si)


def answered(
    plant: str,
    answers: Mapping[str, str],
    *,
    double_rod: bool = False,
    hoses: bool = False,
    drop_over_both: bool = False,
) -> list[Entry]:
    """Returns all values of a rig.

    Parameters
    ----------
    plant
        key of `QUESTIONS`.
    answers
        texts by the names of the questions; an empty one is an unknown.
    double_rod, hoses
        as in `ehs_entries`.
    drop_over_both
        whether the rated drop was measured over both edges.

    Raises
    ------
    ValueError
        an answer that is needed is missing, one cannot be read, or they contradict each other.
    """
    given = {name: text for name, text in answers.items() if text.strip()}
    missing = [one for one in QUESTIONS[plant] if one.essential and one.name not in given]
    if missing:
        raise ValueError(
            "still needed: "
            + ", ".join(f"{one.words} (such as {EXAMPLES[one.name]})" for one in missing)
        )
    known = {name: read_answer(plant, name, text) for name, text in given.items()}
    if plant == "axis":
        return axis_entries(known)
    check_pairs(known)
    if drop_over_both and "rated-drop" in known:
        known["rated-drop"] = of_one_edge(known["rated-drop"])
    return ehs_entries(known, double_rod=double_rod, hoses=hoses)


def rig_file_text(name: str, plant: str, entries: Sequence[Entry]) -> str:
    """Returns the rig file with a comment on each value.

    Raises
    ------
    RigError
        the values are none of a rig.
    """
    text = commented_text(name, plant, entries)
    parse_rig(text, source="rig new")
    return text
