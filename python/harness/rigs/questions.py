# SPDX-License-Identifier: MIT
"""What is asked of a machine to make a rig file: questions with units, reasons and examples.

Makes a rig file of answers in the units of engineers; typical values fill the rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from .new import axis_entries, ehs_entries
from .quantities import Quantity, read_quantity
from .rig_file import Entry, commented_text, parse_rig


@dataclass(frozen=True)
class Question:
    """Something that an engineer may know of her machine."""

    name: str
    """Of the option, without dashes."""
    words: str
    """What is asked for."""
    usual: str
    """Unit of a number without one."""
    si: str
    """Unit of the rig file; "command" for the rated command, "grade" for the oil."""
    essential: bool
    """Whether there is no rig without it."""
    why: str
    """What to know about it, for the terminal."""


EHS = (
    Question(
        "bore", "diameter of the piston", "mm", "m", True, "on the name plate of the cylinder"
    ),
    Question("rod", "diameter of the rod", "mm", "m", True, "0 for a plunger without a rod"),
    Question("stroke", "stroke", "mm", "m", True, "from end to end"),
    Question("supply", "supply pressure", "bar", "Pa", True, "absolute; 'barg' for a manometer"),
    Question("rated-flow", "rated flow of the valve", "l/min", "m^3/s", True, "at full command"),
    Question(
        "rated-drop",
        "pressure drop at the rated flow",
        "bar",
        "Pa",
        False,
        "over one edge, P to A. Data sheets often give it over both, P to A and B to T: 70 bar "
        "over both are 35 bar over one",
    ),
    Question(
        "rated-command",
        "command at full opening",
        "V",
        "command",
        False,
        "V, mA or %, the unit of the column in your records",
    ),
    Question("mass", "moved mass", "kg", "kg", False, "'120 kg +- 20 %' for a rough guess"),
    Question(
        "valve-bandwidth",
        "bandwidth of the valve",
        "Hz",
        "Hz",
        False,
        "at -90 degrees, small steps",
    ),
    Question("tank", "tank pressure", "bar", "Pa", False, "absolute, at the valve's T port"),
    Question(
        "bulk-modulus",
        "bulk modulus of the oil",
        "GPa",
        "Pa",
        False,
        "effective, with walls and lines",
    ),
    Question(
        "oil",
        "ISO viscosity grade of the oil",
        "VG",
        "grade",
        False,
        "on the name plate of the power unit: 32, 46 or 68. It scales the typical viscous "
        "friction. A rig file has no density and no viscosity, and the grade hardly changes the "
        "bulk modulus",
    ),
    Question(
        "accumulator-volume",
        "volume of the accumulator at the valve",
        "l",
        "m^3",
        False,
        "with its pre-charge: the supply pressure then droops with the flow that is drawn",
    ),
    Question(
        "accumulator-precharge",
        "gas pressure of the empty accumulator",
        "bar",
        "Pa",
        False,
        "absolute; 'barg' for a manometer",
    ),
    Question(
        "dead-volume",
        "dead volume of each chamber with its line",
        "cm³",
        "m^3",
        False,
        "at the end of the stroke; or leave it empty and give the lines",
    ),
    Question("line-length", "length of each line", "m", "m", False, "from valve to cylinder"),
    Question("line-bore", "inner diameter of each line", "mm", "m", False, ""),
    Question("friction", "dry friction", "N", "N", False, "force to keep the rod moving slowly"),
    Question("viscous-friction", "viscous friction", "N s/m", "N*s/m", False, "force over speed"),
    Question("position-noise", "noise of the position sensor", "um", "m", False, "1-sigma"),
    Question("pressure-noise", "noise of the pressure sensors", "bar", "Pa", False, "1-sigma"),
)
AXIS = (
    Question("mass", "moved mass", "kg", "kg", True, "with what the motor's inertia adds"),
    Question(
        "force-gain",
        "force of the drive over command",
        "N/V",
        "N/V",
        True,
        "of a motor-driven axis, whose motor turns the command into a force",
    ),
    *(q for q in EHS if q.name in ("viscous-friction", "friction", "position-noise")),
)
QUESTIONS = {"ehs": EHS, "axis": AXIS}


def help_of(name: str) -> str:
    """Returns the help of the option of this name."""
    plants = {plant: q for plant, asked in QUESTIONS.items() for q in asked if q.name == name}
    one = next(iter(plants.values()))
    needing = [plant for plant, question in plants.items() if question.essential]
    needed = f"; needed with --plant {needing[0]}" if needing else ""
    why = f" ({one.why})" if one.why else ""
    return f"{one.words}, such as '{EXAMPLES[name]}'{why}{needed}"


EXAMPLES = {
    "bore": "63 mm",
    "rod": "35 mm",
    "stroke": "300 mm",
    "supply": "120 bar",
    "rated-flow": "38 l/min",
    "rated-drop": "35 bar",
    "rated-command": "10 V",
    "mass": "120 kg",
    "valve-bandwidth": "70 Hz",
    "tank": "2 bar",
    "bulk-modulus": "1.1 GPa",
    "oil": "VG 46",
    "accumulator-volume": "1 l",
    "accumulator-precharge": "90 bar",
    "dead-volume": "250 cm³",
    "line-length": "1.5 m",
    "line-bore": "12 mm",
    "friction": "400 N",
    "viscous-friction": "900 N s/m",
    "position-noise": "10 um",
    "pressure-noise": "0.1 bar",
    "force-gain": "35 N/V",
}


# A command whose numbers are per cent says itself which one is the full command.
FULL, PERCENT, FULL_PERCENT = "rated-command", "percent", "100 %"
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
